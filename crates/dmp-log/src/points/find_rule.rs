//! What the times of points mean, found from their values.

use super::{Origin, TimeRule, TimeUnit};

/// Period taken for the test of units where a log has too few stamps for its own, nanoseconds.
pub(crate) const USUAL_PERIOD_NS: i64 = 100_000_000;

/// Times of a scan are nearer to its stamp than so many periods, and so near to each other.
const NEAR_PERIODS: f64 = 2.0;

/// Scans of which one may be left out: the others are to outnumber it.
pub(crate) const ENOUGH: usize = 4;

/// The least and the greatest number that a field with times has in one scan, as they stand in the file.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FieldExtremes {
    /// The scan's place in the log.
    pub(crate) frame: usize,
    pub(crate) stamp_ns: i64,
    pub(crate) smallest: f64,
    pub(crate) largest: f64,
}

/// What a few scans say about a field.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Finding {
    /// One value a scan: no times.
    Constant,
    /// Unit and origin.
    Rule(TimeRule),
    /// Neither; why not.
    Unclear(String),
}

/// Finds the unit in which a scan's times span what a scan takes, 20 to 150 % of `period_ns`, and
/// whether they count from the stamp or from where the stamps count. Units are a thousand apart, so no
/// two can fit.
pub(crate) fn find_rule(seen: &[FieldExtremes], period_ns: i64) -> Finding {
    let mut spans: Vec<f64> =
        seen.iter().map(|scan| scan.largest - scan.smallest).filter(|&span| span > 0.0).collect();
    spans.sort_by(f64::total_cmp);
    let Some(&span) = spans.get(spans.len() / 2) else { return Finding::Constant };
    let period = period_ns as f64;
    let fits = |unit: &TimeUnit| (0.2 * period..=1.5 * period).contains(&(span * unit.in_ns() as f64));
    let Some(unit) = TimeUnit::ALL.into_iter().find(fits) else {
        return Finding::Unclear(format!(
            "a scan spans {span}, which in no unit is near the {:.4} s from scan to scan",
            period / 1e9
        ));
    };
    let ns = unit.in_ns() as f64;
    let near = NEAR_PERIODS * period;
    let relative = |scan: &FieldExtremes| counts_from_stamp(scan, unit, period_ns);
    let absolute = |scan: &FieldExtremes| (scan.smallest * ns - scan.stamp_ns as f64).abs() < near.max(1e9);
    let origin = match (seen.iter().all(relative), seen.iter().all(absolute)) {
        (true, false) => Some(Origin::Stamp),
        (false, true) => Some(Origin::Clock),
        (false, false) => None,
        (true, true) => origin_near_zero(seen, ns, period),
    };
    if let Some(origin) = origin {
        return Finding::Rule(TimeRule::new(unit, origin));
    }
    let first = seen.first().map_or(f64::NAN, |scan| scan.smallest);
    let stamp_ns = seen.first().map_or(0, |scan| scan.stamp_ns);
    if seen.len() > 1 && seen.iter().all(|scan| scan.stamp_ns == stamp_ns) {
        return Finding::Unclear(format!(
            "every scan has the stamp {:.3} s, so that the times, of which the first is {first}, count from nothing: give \
             the scans stamps",
            stamp_ns as f64 / 1e9
        ));
    }
    Finding::Unclear(format!(
        "a scan spans {span}, as {} near the {:.4} s from scan to scan, but the first value {first} is neither \
         near 0 nor near the stamp: a clock of the sensor's own would be first-{}",
        unit.name(),
        period / 1e9,
        unit.symbol()
    ))
}

/// Whether a field of an unknown name is filled as times are: every scan spans nearly the time from scan to scan, in the same
/// unit.
pub(crate) fn may_be_times(seen: &[FieldExtremes], period_ns: i64) -> Option<TimeRule> {
    let Finding::Rule(rule) = find_rule(seen, period_ns) else { return None };
    let periods =
        |scan: &FieldExtremes| (scan.largest - scan.smallest) * rule.unit.in_ns() as f64 / period_ns as f64;
    (seen.len() >= ENOUGH && seen.iter().all(|scan| (0.9..=1.05).contains(&periods(scan)))).then_some(rule)
}

/// Whether times may count from the scan's stamp, which may be its start, middle or end: they lie near it and near each other,
/// so that it does not depend on where in the scan the stamp is.
pub(crate) fn counts_from_stamp(scan: &FieldExtremes, unit: TimeUnit, period_ns: i64) -> bool {
    let (ns, near) = (unit.in_ns() as f64, NEAR_PERIODS * period_ns as f64);
    scan.smallest * ns > -near && scan.largest * ns < near && (scan.largest - scan.smallest) * ns < near
}

/// As [`find_rule`] where times of one scan are unlike those of the others, which agree: a damaged scan is no reason to refuse a
/// log. Also which scan that is.
pub(crate) fn find_rule_of_most(seen: &[FieldExtremes], period_ns: i64) -> (Finding, Option<usize>) {
    let found = find_rule(seen, period_ns);
    let times_seen = |frame: usize| seen.iter().filter(|scan| scan.frame == frame).count();
    let scans = seen.iter().filter(|scan| times_seen(scan.frame) == 1).count();
    if !matches!(found, Finding::Unclear(_)) || scans < ENOUGH {
        return (found, None);
    }
    let without = |frame: usize| {
        let others: Vec<FieldExtremes> = seen.iter().copied().filter(|scan| scan.frame != frame).collect();
        Some((find_rule(&others, period_ns), Some(frame)))
    };
    let is_rule = |found: &(Finding, Option<usize>)| matches!(found.0, Finding::Rule(_));
    let mut agreed = seen.iter().filter_map(|scan| without(scan.frame).filter(is_rule));
    match (agreed.next(), agreed.next()) {
        (Some(found), None) => found,
        _ => (found, None),
    }
}

/// Stamps that start at 0 are near both origins. Absolute times go on with the stamps, relative ones
/// begin anew with every scan.
fn origin_near_zero(seen: &[FieldExtremes], ns: f64, period: f64) -> Option<Origin> {
    let spread = |value: &dyn Fn(&FieldExtremes) -> f64| {
        let (low, high) = seen
            .iter()
            .map(value)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
        high - low
    };
    let stamps = spread(&|scan| scan.stamp_ns as f64);
    let relative = spread(&|scan| scan.smallest * ns);
    let absolute = spread(&|scan| scan.smallest * ns - scan.stamp_ns as f64);
    if stamps < 0.5 * period {
        // All near 0: both say the same, to within the stamps themselves.
        return seen.iter().all(|scan| scan.stamp_ns == 0).then_some(Origin::Stamp);
    }
    match (relative < 0.5 * period, absolute < 0.5 * period) {
        (true, false) => Some(Origin::Stamp),
        (false, true) => Some(Origin::Clock),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STAMP_NS: i64 = 1_690_309_709_285_305_500;

    fn scans(stamp_ns: i64, period_ns: i64, values: impl Fn(i64) -> (f64, f64)) -> Vec<FieldExtremes> {
        (0..5)
            .map(|k| {
                let stamp_ns = stamp_ns + k * period_ns;
                let (smallest, largest) = values(stamp_ns);
                FieldExtremes { frame: k as usize, stamp_ns, smallest, largest }
            })
            .collect()
    }

    #[test]
    fn one_scan_of_five_may_have_other_times() {
        for (smallest, largest) in [(0.0, 3e7), (-5e20, 0.1), (77.0, 77.1)] {
            let mut seen = scans(STAMP_NS, 100_000_000, |_| (0.0, 0.1));
            let rule = TimeRule::new(TimeUnit::Seconds, Origin::Stamp);
            assert_eq!(find_rule_of_most(&seen, 100_000_000), (Finding::Rule(rule), None));
            (seen[3].smallest, seen[3].largest) = (smallest, largest);
            assert_eq!(find_rule_of_most(&seen, 100_000_000), (Finding::Rule(rule), Some(3)));
            (seen[1].smallest, seen[1].largest) = (smallest, largest);
            assert!(matches!(find_rule_of_most(&seen, 100_000_000), (Finding::Unclear(_), None)));
            seen.truncate(3);
            assert!(matches!(find_rule_of_most(&seen, 100_000_000), (Finding::Unclear(_), None)));
        }
    }

    #[test]
    fn every_unit_and_origin_is_found() {
        for stamp_ns in [STAMP_NS, 0] {
            for unit in TimeUnit::ALL {
                let per_unit = unit.in_ns() as f64;
                for start_ns in [0.0, -5e7, -1e8] {
                    let relative = scans(stamp_ns, 100_000_000, |_| {
                        (start_ns / per_unit, (start_ns + 9.9e7) / per_unit)
                    });
                    let found = find_rule(&relative, 100_000_000);
                    assert!(
                        found == Finding::Rule(TimeRule::new(unit, Origin::Stamp)),
                        "{stamp_ns} {unit:?} {start_ns} {found:?}"
                    );
                    let absolute = scans(stamp_ns, 100_000_000, |stamp| {
                        ((stamp as f64 + start_ns) / per_unit, (stamp as f64 + start_ns + 9.9e7) / per_unit)
                    });
                    let found = find_rule(&absolute, 100_000_000);
                    assert!(
                        found == Finding::Rule(TimeRule::new(unit, Origin::Clock)),
                        "{stamp_ns} {unit:?} {start_ns} {found:?}"
                    );
                }
            }
        }
    }

    #[test]
    fn what_is_no_time_is_not_taken_for_one() {
        assert_eq!(find_rule(&scans(STAMP_NS, 100_000_000, |_| (0.0, 0.0)), 100_000_000), Finding::Constant);
        assert_eq!(find_rule(&scans(STAMP_NS, 100_000_000, |_| (7.5, 7.5)), 100_000_000), Finding::Constant);
        assert_eq!(find_rule(&[], 100_000_000), Finding::Constant);
        let garbage = find_rule(&scans(STAMP_NS, 100_000_000, |_| (0.0, 3.0)), 100_000_000);
        assert!(
            matches!(&garbage, Finding::Unclear(why) if why.contains("spans 3") && why.contains("0.1000 s")),
            "{garbage:?}"
        );
        let other_clock = find_rule(&scans(STAMP_NS, 100_000_000, |_| (5000.0, 5000.1)), 100_000_000);
        assert!(
            matches!(&other_clock, Finding::Unclear(why) if why.contains("5000") && why.contains("near the stamp")),
            "{other_clock:?}"
        );
        let infinite = find_rule(&scans(STAMP_NS, 100_000_000, |_| (0.0, f64::INFINITY)), 100_000_000);
        assert!(matches!(infinite, Finding::Unclear(_)));
    }
}
