//! Numbers, lines and tables for people.

mod lines;
mod table;

use dmp_lengths::thousands;
use dmp_report::{SegmentLength, SegmentReport};

pub use lines::{shortened, width_of, wrapped};
pub use table::{Side, Table};

/// What stands where there is no number.
pub const NONE: &str = "–";

/// Three significant digits; whole numbers keep all of theirs, with commas between the thousands, tiny ones get an exponent.
pub fn digits(value: f64) -> String {
    thousands(plain_digits(value).as_str())
}

/// The same without commas: for what programs read too.
pub fn plain_digits(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return value.abs().to_string();
    }
    // Rounded first: 9.996 has its third digit where 10.0 has it.
    let rounded: f64 = format!("{value:.2e}").parse().unwrap_or(value);
    match rounded.abs().log10().floor() as i32 {
        ..=-4 => format!("{value:.2e}"),
        exponent @ ..=1 => format!("{rounded:.*}", (2 - exponent) as usize),
        _ => format!("{value:.0}"),
    }
}

/// A share in percent, with one decimal.
pub fn percent(share: f64) -> String {
    format!("{:.1}", 100.0 * share)
}

/// How sure something is, in percent: `99 %`, `99.9962 %`; what is left of 100 % has two digits.
pub fn confidence(level: f64) -> String {
    percent_of(level, 1.0 - level)
}

/// What is left to chance where something is so sure: `1 %`, `0.25 %`.
pub fn left(level: f64) -> String {
    percent_of(1.0 - level, 1.0 - level)
}

/// In percent, as exactly as shows two digits of `smallest`; without zeros behind.
fn percent_of(share: f64, smallest: f64) -> String {
    let digits = (1.0 - libm::log10(100.0 * smallest.max(1e-14))).ceil().clamp(1.0, 13.0);
    let text = format!("{:.*}", digits as usize, 100.0 * share);
    format!("{} %", text.trim_end_matches('0').trim_end_matches('.'))
}

/// A count with commas between the thousands.
pub fn count(count: u64) -> String {
    thousands(count)
}

/// `one scan`, `2 scans`.
pub fn counted(number: u64, what: &str) -> String {
    let plural = if number == 1 { "" } else { "s" };
    format!("{} {what}{plural}", count(number))
}

/// A number with its thousands as a prefix for the unit, for rates: `1.23 M`.
pub fn short(value: f64) -> String {
    let (factor, prefix) = match value {
        v if v >= 1e9 => (1e9, " G"),
        v if v >= 1e6 => (1e6, " M"),
        v if v >= 1e4 => (1e3, " k"),
        _ => (1.0, ""),
    };
    format!("{}{prefix}", digits(value / factor))
}

/// Bytes in binary units: `3.91 MiB`.
pub fn bytes(bytes: u64) -> String {
    let units = [("GiB", 30), ("MiB", 20), ("KiB", 10)];
    match units.into_iter().find(|&(_, shift)| bytes >> shift > 0) {
        Some((unit, shift)) => format!("{} {unit}", digits(bytes as f64 / (1_u64 << shift) as f64)),
        None => format!("{} B", count(bytes)),
    }
}

/// A duration: `0.513 s`, `61.2 s`, `12 min 5 s`, `2 h 3 min`.
pub fn duration(seconds: f64) -> String {
    let whole = seconds.round() as u64;
    match whole {
        0..=99 => format!("{} s", digits(seconds)),
        100..=5999 => format!("{} min {} s", whole / 60, whole % 60),
        _ => format!("{} h {} min", whole / 3600, whole % 3600 / 60),
    }
}

/// How the paths of runs were cut: `17 segments of 12 m`, `16 to 17 segments`.
pub fn segments_in_words<'s>(of_runs: impl Iterator<Item = &'s SegmentReport> + Clone) -> String {
    let counts = of_runs.clone().map(|segments| segments.count as u64);
    let [least, most] = [counts.clone().min(), counts.max()].map(Option::unwrap_or_default);
    let count = if least == most {
        counted(most, "segment")
    } else {
        format!("{} to {}", count(least), counted(most, "segment"))
    };
    // Whole metres without a decimal, as everybody writes them.
    let mut lengths = of_runs.map(|segments| match segments.length() {
        Some(SegmentLength::Metres(m)) => format!(" of {} m", (10.0 * m).round() / 10.0),
        Some(SegmentLength::Seconds(s)) => format!(" of {s} s"),
        Some(SegmentLength::Scans(scans)) => format!(" of {}", counted(scans, "scan")),
        None => String::new(),
    });
    let first = lengths.next().unwrap_or_default();
    let is_one = lengths.all(|length| length == first);
    match first.as_str() {
        "" if is_one => "every scan a segment".to_owned(),
        length if is_one => count + length,
        _ => count,
    }
}

/// Nanoseconds as seconds.
pub fn seconds(ns: i64) -> f64 {
    ns as f64 / 1e9
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_digits_are_kept_and_none_invented() {
        let cases = [
            (0.0, "0"),
            (-0.0, "0"),
            (0.000_123_4, "1.23e-4"),
            (0.001_234, "0.00123"),
            (0.0999_6, "0.100"),
            (1.0, "1.00"),
            (-1.234, "-1.23"),
            (9.996, "10.0"),
            (99.96, "100"),
            (123.4, "123"),
            (123_456.7, "123,457"),
            (-1234.5, "-1,234"),
        ];
        for (value, expected) in cases {
            assert_eq!(digits(value), expected);
        }
        assert_eq!([-123_456.7, 0.123].map(plain_digits), ["-123457", "0.123"]);
    }

    #[test]
    fn counts_bytes_and_durations_are_readable() {
        assert_eq!([0, 12, 999, 1000, 1_234_567].map(count), ["0", "12", "999", "1,000", "1,234,567"]);
        assert_eq!([1, 2].map(|n| counted(n, "scan")), ["1 scan", "2 scans"]);
        assert_eq!([500.0, 56_780.0, 1.23e6].map(short), ["500", "56.8 k", "1.23 M"]);
        assert_eq!(
            [0, 1023, 1024, 4 << 20, 5 << 40].map(bytes),
            ["0 B", "1,023 B", "1.00 KiB", "4.00 MiB", "5,120 GiB"]
        );
        assert_eq!(
            [0.0123, 61.24, 725.0, 7384.0].map(duration),
            ["0.0123 s", "61.2 s", "12 min 5 s", "2 h 3 min"]
        );
    }

    #[test]
    fn segments_are_as_long_as_they_were_cut() {
        let mut segments = SegmentReport {
            length_m: Some(12.04),
            length_s: None,
            length_scans: Some(3),
            count: 1234,
            travel_m: 0.0,
            starts_ns: Vec::new(),
            starts_scan: Vec::new(),
        };
        assert_eq!(segments_in_words(std::iter::once(&segments)), "1,234 segments of 12 m");
        segments.length_m = None;
        assert_eq!(segments_in_words(std::iter::once(&segments)), "1,234 segments of 3 scans");
        segments.length_scans = None;
        assert_eq!(segments_in_words(std::iter::once(&segments)), "every scan a segment");
    }

    #[test]
    fn what_is_left_to_chance_has_two_digits() {
        assert_eq!([0.99, 0.9975, 0.999_962_1].map(confidence), ["99 %", "99.75 %", "99.9962 %"]);
        assert_eq!([0.99, 0.9975, 0.95, 0.5].map(left), ["1 %", "0.25 %", "5 %", "50 %"]);
    }
}
