//! What the times of the points mean: in which unit, and counted from where.

use std::fmt;
use std::str::FromStr;

/// The names under which drivers store the time of a point, most telling first.
const FIELD_NAMES: [&str; 17] = [
    "t",
    "time",
    "timestamp",
    "time_stamp",
    "timeStamp",
    "offset_time",
    "time_offset",
    "timeOffset",
    "offsetTime",
    "ts",
    "stamp",
    "point_time",
    "timestamps",
    "times",
    "gps_time",
    "GpsTime",
    "gpstime",
];

/// Period taken for the test of units where a log has too few stamps to tell its own, nanoseconds.
pub(crate) const USUAL_PERIOD_NS: i64 = 100_000_000;

/// A unit of time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TimeUnit {
    /// Seconds.
    Seconds,
    /// Milliseconds.
    Milliseconds,
    /// Microseconds.
    Microseconds,
    /// Nanoseconds.
    Nanoseconds,
}

impl TimeUnit {
    const ALL: [Self; 4] = [Self::Seconds, Self::Milliseconds, Self::Microseconds, Self::Nanoseconds];

    pub(super) fn in_ns(self) -> i64 {
        match self {
            Self::Seconds => 1_000_000_000,
            Self::Milliseconds => 1_000_000,
            Self::Microseconds => 1_000,
            Self::Nanoseconds => 1,
        }
    }

    fn symbol(self) -> &'static str {
        match self {
            Self::Seconds => "s",
            Self::Milliseconds => "ms",
            Self::Microseconds => "us",
            Self::Nanoseconds => "ns",
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Seconds => "seconds",
            Self::Milliseconds => "milliseconds",
            Self::Microseconds => "microseconds",
            Self::Nanoseconds => "nanoseconds",
        }
    }
}

/// What the user says about the times of the points.
///
/// As text: `auto`, `ignore`, `s`, `ms`, `us`, `ns` (after the scan's stamp), `absolute-s`, … (on the clock
/// of the stamps), `first-s`, … (on a clock of their own: after the first point of the scan).
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum PointTime {
    /// Unit and origin are found from the values.
    #[default]
    Auto,
    /// Times of points are not used.
    Ignore,
    /// Counted from the scan's stamp.
    Relative(TimeUnit),
    /// On the clock of the stamps.
    Absolute(TimeUnit),
    /// On another clock: what counts is how long after the scan's first point.
    FromFirst(TimeUnit),
}

impl fmt::Display for PointTime {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Auto => f.write_str("auto"),
            Self::Ignore => f.write_str("ignore"),
            Self::Relative(unit) => f.write_str(unit.symbol()),
            Self::Absolute(unit) => write!(f, "absolute-{}", unit.symbol()),
            Self::FromFirst(unit) => write!(f, "first-{}", unit.symbol()),
        }
    }
}

impl FromStr for PointTime {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let unit = |symbol: &str| TimeUnit::ALL.into_iter().find(|unit| unit.symbol() == symbol);
        let meaning = match (text, text.split_once('-')) {
            ("auto", _) => Some(Self::Auto),
            ("ignore", _) => Some(Self::Ignore),
            (_, Some(("absolute", symbol))) => unit(symbol).map(Self::Absolute),
            (_, Some(("first", symbol))) => unit(symbol).map(Self::FromFirst),
            _ => unit(text).map(Self::Relative),
        };
        meaning.ok_or_else(|| {
            format!(
                "`{text}` is none of auto, ignore, s, ms, us, ns, absolute-s, absolute-ms, absolute-us, absolute-ns, \
                 first-s, first-ms, first-us, first-ns"
            )
        })
    }
}

/// Which instant of a scan its stamp is. It matters where times count from the scan's beginning.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum StampAt {
    /// Its first point.
    #[default]
    Start,
    /// The middle between first and last point.
    Mid,
    /// Its last point.
    End,
}

impl StampAt {
    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Start => "start",
            Self::Mid => "mid",
            Self::End => "end",
        }
    }
}

impl FromStr for StampAt {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = [Self::Start, Self::Mid, Self::End].into_iter().find(|at| at.name() == text);
        found.ok_or_else(|| format!("`{text}` is none of start, mid, end"))
    }
}

/// A time as it stands in the file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum RawTime {
    Integer(i64),
    Float(f64),
}

impl RawTime {
    /// A time beyond 63 bits keeps what a double keeps of it.
    #[inline]
    pub(super) fn of_u64(value: u64) -> Self {
        i64::try_from(value).map_or(Self::Float(value as f64), Self::Integer)
    }

    #[inline]
    fn minus(self, other: Self) -> Option<Self> {
        match (self, other) {
            (Self::Integer(a), Self::Integer(b)) => a.checked_sub(b).map(Self::Integer),
            (a, b) => Some(Self::Float(a.as_f64() - b.as_f64())),
        }
    }

    pub(crate) fn as_f64(self) -> f64 {
        match self {
            Self::Integer(value) => value as f64,
            Self::Float(value) => value,
        }
    }
}

/// From where the times of a log's points count.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Origin {
    /// The scan's stamp, or the instant that the shift puts it at.
    Stamp,
    /// Where the stamps count from.
    Clock,
    /// The scan's first point.
    FirstPoint,
}

/// How the times of a log's points are turned into nanoseconds after the stamp.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct TimeRule {
    pub(crate) unit: TimeUnit,
    pub(crate) origin: Origin,
    /// Added to every offset, nanoseconds: where the stamp is not where the times count from.
    pub(crate) shift_ns: i64,
}

impl TimeRule {
    pub(crate) fn new(unit: TimeUnit, origin: Origin) -> Self {
        Self { unit, origin, shift_ns: 0 }
    }

    /// What the user has said; `None` for `auto` and `ignore`.
    pub(crate) fn given(point_time: PointTime) -> Option<Self> {
        match point_time {
            PointTime::Auto | PointTime::Ignore => None,
            PointTime::Relative(unit) => Some(Self::new(unit, Origin::Stamp)),
            PointTime::Absolute(unit) => Some(Self::new(unit, Origin::Clock)),
            PointTime::FromFirst(unit) => Some(Self::new(unit, Origin::FirstPoint)),
        }
    }

    /// Whether it counts from the first point of the scan.
    pub(crate) fn needs_first(self) -> bool {
        self.origin == Origin::FirstPoint
    }

    /// Nanoseconds after `stamp_ns`; `None` for what is not a number or beyond all dates. `first` is the
    /// scan's first point, for a rule that counts from it.
    #[inline]
    pub(crate) fn offset_ns(self, raw: RawTime, stamp_ns: i64, first: Option<RawTime>) -> Option<i64> {
        let ns = match (self.origin, raw) {
            // Differences first: a double of seconds since 1970 resolves 240 ns, its differences are exact.
            (Origin::FirstPoint, raw) => self.ns(raw.minus(first?)?)?,
            (Origin::Clock, raw) => self.ns(raw)?.checked_sub(stamp_ns)?,
            (Origin::Stamp, raw) => self.ns(raw)?,
        };
        ns.checked_add(self.shift_ns)
    }

    /// The offset of a 32-bit number of the most common kind, counted from the stamp: it fits in 64 bits in
    /// every unit, so nothing has to be checked.
    pub(super) fn of_u32(self) -> Option<impl Fn(u32) -> i64> {
        let (unit_ns, shift_ns) = (self.unit.in_ns(), self.shift_ns);
        let fits = shift_ns.abs() < 1 << 40;
        (self.origin == Origin::Stamp && fits).then_some(move |value| i64::from(value) * unit_ns + shift_ns)
    }

    /// The offset of a float32, counted from the stamp: a product of 24 and 21 bits is exact as a double, so
    /// nothing has to be taken apart. As [`TimeRule::offset_ns`], in half the time.
    pub(crate) fn of_f32(self) -> Option<impl Fn(f32) -> Option<i64>> {
        const LARGEST_NS: f64 = (1_i64 << 61) as f64;
        let (unit_ns, shift_ns) = (self.unit.in_ns() as f64, self.shift_ns);
        let fits = shift_ns.abs() < 1 << 40;
        (self.origin == Origin::Stamp && fits).then_some(move |value| {
            let ns = f64::from(value) * unit_ns;
            // Compares as false for NaN.
            (ns.abs() < LARGEST_NS).then(|| nearest(ns) + shift_ns)
        })
    }

    #[inline]
    fn ns(self, raw: RawTime) -> Option<i64> {
        match raw {
            RawTime::Integer(value) => value.checked_mul(self.unit.in_ns()),
            RawTime::Float(value) => {
                let unit_ns = self.unit.in_ns();
                // Compares as false for NaN. The limit is 2^63, which `i64::MAX as f64` rounds to.
                let whole = (value.abs() < i64::MAX as f64).then_some(value as i64)?;
                // Whole units apart: as a double, nanoseconds since 1970 resolve 256 ns, coarser than seconds do.
                let part_ns = nearest((value - whole as f64) * unit_ns as f64);
                whole.checked_mul(unit_ns)?.checked_add(part_ns)
            }
        }
    }

    pub(crate) fn words(self) -> String {
        let origin = match self.origin {
            Origin::Stamp if self.shift_ns == 0 => "after the scan's stamp",
            Origin::Stamp => "after the scan's start",
            Origin::Clock => "on the clock of the stamps",
            Origin::FirstPoint => "after the scan's first point",
        };
        format!("{} {origin}", self.unit.name())
    }
}

/// As `round`, halves away from zero, for what is far from the limits: that one is a call on most processors.
#[inline]
fn nearest(value: f64) -> i64 {
    let whole = value as i64;
    let rest = value - whole as f64;
    whole + i64::from(rest >= 0.5) - i64::from(rest <= -0.5)
}

/// Position in `names` of the fields that may hold times, most telling first.
pub(crate) fn candidates<'a>(names: &[&'a str]) -> Vec<(usize, &'a str)> {
    FIELD_NAMES
        .iter()
        .filter_map(|wanted| names.iter().position(|name| name == wanted))
        .filter_map(|index| names.get(index).map(|&name| (index, name)))
        .collect()
}

/// The times of one scan's returns, as they stand in the file.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SampledScan {
    pub(crate) stamp_ns: i64,
    pub(crate) smallest: f64,
    pub(crate) largest: f64,
}

/// What a sample of scans says about a field.
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
pub(crate) fn find_rule(sample: &[SampledScan], period_ns: i64) -> Finding {
    let mut spans: Vec<f64> =
        sample.iter().map(|scan| scan.largest - scan.smallest).filter(|&span| span > 0.0).collect();
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
    // A stamp may be the scan's start, middle or end.
    let near = 2.0 * period;
    let relative = |scan: &SampledScan| scan.smallest * ns > -near && scan.largest * ns < near;
    let absolute = |scan: &SampledScan| (scan.smallest * ns - scan.stamp_ns as f64).abs() < near.max(1e9);
    let origin = match (sample.iter().all(relative), sample.iter().all(absolute)) {
        (true, false) => Some(Origin::Stamp),
        (false, true) => Some(Origin::Clock),
        (false, false) => None,
        (true, true) => origin_near_zero(sample, ns, period),
    };
    if let Some(origin) = origin {
        return Finding::Rule(TimeRule::new(unit, origin));
    }
    let first = sample.first().map_or(f64::NAN, |scan| scan.smallest);
    Finding::Unclear(format!(
        "a scan spans {span}, as {} near the {:.4} s from scan to scan, but the first value {first} is neither \
         near 0 nor near the stamp: where it is a clock of the sensor's own, say --point-time first-{}",
        unit.name(),
        period / 1e9,
        unit.symbol()
    ))
}

/// Stamps that start at 0 are near both origins. Absolute times go on with the stamps, relative ones
/// begin anew with every scan.
fn origin_near_zero(sample: &[SampledScan], ns: f64, period: f64) -> Option<Origin> {
    let spread = |value: &dyn Fn(&SampledScan) -> f64| {
        let (low, high) = sample
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
        return sample.iter().all(|scan| scan.stamp_ns == 0).then_some(Origin::Stamp);
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

    fn scans(stamp_ns: i64, period_ns: i64, values: impl Fn(i64) -> (f64, f64)) -> Vec<SampledScan> {
        (0..5)
            .map(|k| {
                let stamp_ns = stamp_ns + k * period_ns;
                let (smallest, largest) = values(stamp_ns);
                SampledScan { stamp_ns, smallest, largest }
            })
            .collect()
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

    #[test]
    fn offsets_are_exact_and_never_overflow() {
        let absolute = TimeRule::new(TimeUnit::Nanoseconds, Origin::Clock);
        assert_eq!(absolute.offset_ns(RawTime::Integer(STAMP_NS + 3), STAMP_NS, None), Some(3));
        assert_eq!(absolute.offset_ns(RawTime::Integer(i64::MAX), i64::MIN, None), None);
        let seconds = TimeRule::new(TimeUnit::Seconds, Origin::Stamp);
        assert_eq!(seconds.offset_ns(RawTime::Float(0.0123), 5, None), Some(12_300_000));
        for none in [f64::NAN, f64::INFINITY, 1e30, -1e30] {
            assert_eq!(seconds.offset_ns(RawTime::Float(none), 0, None), None);
        }
        assert_eq!(seconds.offset_ns(RawTime::Integer(i64::MAX), 0, None), None);
    }

    #[test]
    fn float32_takes_the_short_way_to_the_same_times() {
        let values = [0.0, -0.0, 0.1, 0.099_999_9, -0.05, 1.5e-9, 2.5e-9, 123.456, 1e9, f32::MIN_POSITIVE];
        for unit in TimeUnit::ALL {
            let rule = TimeRule { shift_ns: -17, ..TimeRule::new(unit, Origin::Stamp) };
            let short = rule.of_f32().unwrap();
            for value in values {
                let long = rule.offset_ns(RawTime::Float(value.into()), 5, None);
                assert_eq!(short(value), long, "{unit:?} {value}");
            }
            for none in [f32::NAN, f32::INFINITY, f32::MIN] {
                assert_eq!(short(none), None);
            }
        }
        assert!(TimeRule::new(TimeUnit::Seconds, Origin::Clock).of_f32().is_none());
    }

    #[test]
    fn the_nearest_integer_is_that_of_round() {
        let halves = [0.499_999_999_999_999_94, 0.5, 1.5, 2.5, 1e9 - 0.5, 1e9 + 0.25];
        let many = (0..10_000).map(|k| f64::from(k) * 0.137_531 - 600.0);
        for value in halves.into_iter().flat_map(|half: f64| [half, -half]).chain(many) {
            assert_eq!(nearest(value), value.round() as i64, "{value}");
        }
    }

    #[test]
    fn the_option_is_read_as_it_is_written() {
        for text in [
            "auto",
            "ignore",
            "s",
            "ms",
            "us",
            "ns",
            "absolute-s",
            "absolute-ms",
            "absolute-us",
            "absolute-ns",
            "first-s",
            "first-ms",
            "first-us",
            "first-ns",
        ] {
            assert_eq!(text.parse::<PointTime>().unwrap().to_string(), text);
        }
        assert!("seconds".parse::<PointTime>().unwrap_err().contains("`seconds`"));
    }
}
