//! Decimal seconds to and from nanoseconds, exactly, and text cut short for messages.

use crate::TimeUnit;

/// Digits kept of a number; what follows is below any unit used here.
const MAX_DIGITS: u32 = 30;

/// Nanoseconds of a decimal number of seconds, exactly: `1690309709.285305500`, `-0.5`, `1.4e+09`.
/// What is finer than a nanosecond is rounded, halves away from zero.
///
/// An `f64` has 240 ns between neighbours at today's dates: stamps must not go through one.
pub(crate) fn seconds_to_ns(text: &str) -> Result<i64, String> {
    to_ns(text, TimeUnit::Seconds)
}

/// The same of a decimal number in some unit.
pub(crate) fn to_ns(text: &str, unit: TimeUnit) -> Result<i64, String> {
    let not_a_number = || format!("not a number of {}: `{}`", unit.name(), shorten(text));
    let (negative, digits) = match text.as_bytes() {
        [b'-', rest @ ..] => (true, rest),
        [b'+', rest @ ..] | rest => (false, rest),
    };
    let mantissa_end = digits.iter().position(|c| matches!(c, b'e' | b'E')).unwrap_or(digits.len());
    let (mantissa_text, exponent_text) = digits.split_at(mantissa_end);
    let mut exponent: i32 = match exponent_text.get(1..) {
        None => 0,
        Some(rest) => {
            std::str::from_utf8(rest).ok().and_then(|text| text.parse().ok()).ok_or_else(not_a_number)?
        }
    };
    let (mut mantissa, mut kept, mut any, mut after_point) = (0_i128, 0_u32, false, false);
    for &c in mantissa_text {
        match c {
            b'.' if !after_point => after_point = true,
            b'0'..=b'9' => {
                any = true;
                if kept < MAX_DIGITS {
                    mantissa = mantissa * 10 + i128::from(c - b'0');
                    // Leading zeros cost no precision.
                    kept += u32::from(mantissa != 0);
                    exponent = exponent.saturating_sub(i32::from(after_point));
                } else {
                    exponent = exponent.saturating_add(i32::from(!after_point));
                }
            }
            _ => return Err(not_a_number()),
        }
    }
    if !any {
        return Err(not_a_number());
    }
    let too_far = || {
        let (text, unit) = (shorten(text), unit.symbol());
        format!("a stamp of `{text}` {unit} is beyond the years 1677 to 2262: is it in another unit?")
    };
    let shift = exponent.saturating_add(unit.decimals_of_ns());
    let magnitude = if mantissa == 0 {
        0
    } else if shift >= 0 {
        let factor = 10_i128.checked_pow(shift.unsigned_abs()).ok_or_else(too_far)?;
        mantissa.checked_mul(factor).ok_or_else(too_far)?
    } else {
        10_i128.checked_pow(shift.unsigned_abs()).map_or(0, |divisor| (mantissa + divisor / 2) / divisor)
    };
    i64::try_from(if negative { -magnitude } else { magnitude }).map_err(|_| too_far())
}

/// `ns` as seconds with nine decimals: the inverse of [`seconds_to_ns`].
pub(crate) fn ns_to_seconds(ns: i64) -> String {
    let sign = if ns < 0 { "-" } else { "" };
    let magnitude = ns.unsigned_abs();
    format!("{sign}{}.{:09}", magnitude / 1_000_000_000, magnitude % 1_000_000_000)
}

/// The beginning of a text that goes into an error message, on one line: files may have anything in them.
pub(crate) fn shorten(text: &str) -> String {
    const MOST: usize = 60;
    let mut chars = text.chars().map(|c| if c.is_control() { ' ' } else { c });
    let start: String = chars.by_ref().take(MOST).collect();
    if chars.next().is_some() { start + "…" } else { start }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seconds_are_read_to_the_nanosecond() {
        let cases = [
            ("1690309709.285305500", 1_690_309_709_285_305_500),
            ("1.403636579763555584e+09", 1_403_636_579_763_555_584),
            ("1403636579763555584E-9", 1_403_636_579_763_555_584),
            ("-0.5", -500_000_000),
            ("+.25", 250_000_000),
            ("3.", 3_000_000_000),
            ("0", 0),
            ("0.0000000005", 1),
            ("-0.0000000005", -1),
            ("0.00000000049", 0),
            ("1e-400", 0),
            ("0e999999999", 0),
            ("0.00000000000000000000000000000000000000000000000001e50", 1_000_000_000),
            ("9223372036.854775807", i64::MAX),
            ("-9223372036.854775808", i64::MIN),
            ("1.5000000000000000000000000000000000000000000000000001", 1_500_000_000),
        ];
        for (text, ns) in cases {
            assert_eq!(seconds_to_ns(text), Ok(ns), "{text}");
        }
        for text in ["", "-", ".", "e5", "1e", "1.2.3", "nan", "inf", "0x10", "1 2", "1e5.5", "１"] {
            assert!(seconds_to_ns(text).unwrap_err().contains("not a number"), "{text}");
        }
        for text in ["1403636579763555584", "1e400", "9223372036.854775808", "1e2147483647"] {
            assert!(seconds_to_ns(text).unwrap_err().contains("another unit"), "{text}");
        }
    }

    #[test]
    fn a_text_of_a_file_stays_short_and_on_its_line() {
        assert_eq!(shorten("a topic"), "a topic");
        assert_eq!(shorten("a\ntopic\u{1b}[2J"), "a topic [2J");
        assert_eq!(shorten(&"é".repeat(60)), "é".repeat(60));
        assert_eq!(shorten(&"é".repeat(100_000)), "é".repeat(60) + "…");
    }

    #[test]
    fn the_writer_is_the_inverse() {
        for ns in [0, 1, -1, i64::MAX, i64::MIN, 1_403_636_579_763_555_584, -999_999_999] {
            assert_eq!(seconds_to_ns(&ns_to_seconds(ns)), Ok(ns));
        }
    }
}
