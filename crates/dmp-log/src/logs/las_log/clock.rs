//! The clocks of LAS files and trajectories.

use super::made_with::MadeWith;
use crate::file::ns_to_seconds;
use crate::geometry::cloud::las_header::GpsTime;
use crate::{LogError, LogSetting};
use std::path::Path;

const SECOND_NS: i64 = 1_000_000_000;
const WEEK_NS: i128 = 604_800 * SECOND_NS as i128;
/// What LAS takes off GPS seconds to keep digits.
const STANDARD_NS: i128 = 1_000_000_000 * SECOND_NS as i128;
/// 1980-01-06 in seconds since 1970.
const GPS_EPOCH_NS: i128 = 315_964_800 * SECOND_NS as i128;
/// How far GPS is ahead of UTC, seconds, from these seconds since 1970 on (IERS Bulletin C).
const LEAPS: [(i128, i128); 6] = [
    (1_483_228_800, 18),
    (1_435_708_800, 17),
    (1_341_100_800, 16),
    (1_230_768_000, 15),
    (1_136_073_600, 14),
    (i128::MIN, 13),
];

/// Nanoseconds of a time in a LAS point; `None` for what is no number or beyond all dates.
#[inline]
pub(super) fn gps_ns(time_s: f64) -> Option<i64> {
    let ns = (time_s * 1e9).round();
    // Compares as false for NaN. The limit is 2^63, which `i64::MAX as f64` rounds to.
    (ns.abs() < i64::MAX as f64).then_some(ns as i64)
}

/// Refuses a file and a trajectory that have no instant in common, with the offset that would give them one.
pub(super) fn check_overlap(
    path: &Path,
    kind: GpsTime,
    span_ns: (i64, i64),
    made_with: &MadeWith,
) -> Result<(), LogError> {
    let stamps = made_with.trajectory.stamps_ns().unwrap_or_default();
    let (Some(&start), Some(&end)) = (stamps.first(), stamps.last()) else { return Ok(()) };
    let offset = i128::from(made_with.time_offset_ns);
    let (first, last) = (i128::from(span_ns.0) + offset, i128::from(span_ns.1) + offset);
    let (start, end) = (i128::from(start), i128::from(end));
    let gap = (start - last).max(first - end);
    if gap <= 0 {
        return Ok(());
    }
    let s = |ns: i128| ns as f64 / 1e9;
    let spans = format!(
        "its times span {:.3} to {:.3} s, the trajectory {:.3} to {:.3} s: they are {:.3} s apart",
        s(first),
        s(last),
        s(start),
        s(end),
        s(gap)
    );
    let (advice, offset_ns) =
        match offset_of(kind, (i128::from(span_ns.0), i128::from(span_ns.1)), (start, end)) {
            Some((offset_ns, meaning)) => (format!("{meaning}: what brings them together is"), offset_ns),
            // What is known of GPS clocks does not help: the first instants put together.
            None => (
                "if their clocks differ, what puts their beginnings together is".to_owned(),
                i64::try_from(start - i128::from(span_ns.0)).unwrap_or(i64::MAX),
            ),
        };
    let problem = format!("{spans}; {advice}, in seconds,");
    Err(LogError::missing(path, problem, LogSetting::TimeOffset, seconds(offset_ns)))
}

/// The known offset of clocks with which two spans have most in common, and what it means.
fn offset_of(kind: GpsTime, log: (i128, i128), run: (i128, i128)) -> Option<(i64, &'static str)> {
    let middle = run.0.midpoint(run.1);
    let leap = LEAPS.iter().find(|(from_s, _)| middle / i128::from(SECOND_NS) >= *from_s);
    let leap_ns = leap.map_or(0, |(_, seconds)| seconds * i128::from(SECOND_NS));
    let log_middle = log.0.midpoint(log.1);
    let of_week = |base: i128| base + nearest(middle - log_middle - base, WEEK_NS) * WEEK_NS;
    let candidates = match kind {
        GpsTime::Standard => [
            (STANDARD_NS + GPS_EPOCH_NS - leap_ns, "the trajectory seems to have UTC"),
            (STANDARD_NS + GPS_EPOCH_NS, "the trajectory seems to have GPS time, from 1970 on"),
            (STANDARD_NS, "the trajectory seems to have GPS time"),
            (of_week(STANDARD_NS), "the trajectory seems to have seconds of the GPS week"),
        ],
        GpsTime::Week => [
            (
                of_week(GPS_EPOCH_NS - leap_ns),
                "the trajectory seems to have UTC, the file seconds of the GPS week",
            ),
            (
                of_week(GPS_EPOCH_NS),
                "the trajectory seems to have GPS time from 1970 on, the file seconds of the week",
            ),
            (of_week(0), "the trajectory seems to have GPS time, the file seconds of the week"),
            (
                of_week(-STANDARD_NS),
                "the trajectory seems to have GPS time less 1e9, the file seconds of the week",
            ),
        ],
    };
    let common = |offset: i128| (log.1 + offset).min(run.1) - (log.0 + offset).max(run.0);
    let mut best: Option<(i128, i64, &'static str)> = None;
    for (offset, meaning) in candidates {
        let Ok(offset_ns) = i64::try_from(offset) else { continue };
        let common = common(offset);
        // Of equals the first.
        if common >= 0 && best.is_none_or(|best| common > best.0) {
            best = Some((common, offset_ns, meaning));
        }
    }
    best.map(|(_, offset_ns, meaning)| (offset_ns, meaning))
}

/// The whole number nearest to a quotient.
fn nearest(value: i128, by: i128) -> i128 {
    (value + by / 2).div_euclid(by)
}

fn seconds(ns: i64) -> String {
    ns_to_seconds(ns).trim_end_matches('0').trim_end_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 2023-07-25 18:28:29 UTC.
    const UTC_S: i128 = 1_690_309_709;

    fn spans(log_s: i128, run_s: i128) -> [(i128, i128); 2] {
        let ns = i128::from(SECOND_NS);
        // The log is within the run.
        [(log_s * ns, (log_s + 60) * ns), ((run_s - 5) * ns, (run_s + 65) * ns)]
    }

    fn found(kind: GpsTime, log_s: i128, run_s: i128) -> Option<String> {
        let [log, run] = spans(log_s, run_s);
        offset_of(kind, log, run).map(|(offset_ns, meaning)| format!("{} {meaning}", seconds(offset_ns)))
    }

    #[test]
    fn known_clocks_are_brought_together() {
        let gps_s = UTC_S - 315_964_800 + 18;
        let (week, of_week) = (gps_s / 604_800, gps_s % 604_800);
        let standard = gps_s - 1_000_000_000;
        let cases = [
            (GpsTime::Standard, standard, UTC_S, "1315964782 ", "UTC"),
            (GpsTime::Standard, standard, gps_s, "1000000000 ", "GPS time"),
            (GpsTime::Standard, standard, of_week, &format!("{} ", 1_000_000_000 - week * 604_800), "week"),
            (GpsTime::Week, of_week, UTC_S, &format!("{} ", UTC_S - of_week), "UTC"),
            (GpsTime::Week, of_week, gps_s, &format!("{} ", week * 604_800), "GPS time, the file"),
            (GpsTime::Week, of_week, standard, &format!("{} ", standard - of_week), "less 1e9"),
        ];
        for (kind, log_s, run_s, offset, meaning) in cases {
            let found = found(kind, log_s, run_s).unwrap();
            assert!(found.starts_with(offset) && found.contains(meaning), "{found}, not {offset}");
        }
        // GPS was 16 s ahead in 2014.
        let utc_s = 1_400_000_000;
        let found_2014 = found(GpsTime::Standard, utc_s - 315_964_800 + 16 - 1_000_000_000, utc_s);
        assert!(found_2014.unwrap().starts_with("1315964784 "));
        assert_eq!(found(GpsTime::Standard, 100_000, 500), None);
    }

    #[test]
    fn times_are_numbers() {
        assert_eq!(gps_ns(0.25), Some(250_000_000));
        assert_eq!(gps_ns(-1.0), Some(-SECOND_NS));
        for none in [f64::NAN, f64::INFINITY, 1e10, -1e10] {
            assert_eq!(gps_ns(none), None);
        }
    }
}
