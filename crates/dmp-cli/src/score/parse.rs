//! Values on the command line of `dmp score`.

use std::str::FromStr;
use std::time::Duration;

use dmp::{Ego, LengthUnit, MissPrice, Scales, SegmentLength};
use dmp_sensor::{Isometry3, Quaternion, Translation3, UnitQuaternion};

use crate::parse::length_m;

/// What `--memory unlimited` stands for, bytes: more than any machine has, and exact in every JSON reader.
const UNLIMITED_BYTES: usize = 1 << 52;
/// How far the norm of a quaternion may be from 1: numbers are typed with few digits.
const NORM_TOLERANCE: f64 = 0.02;

/// A length that may be left to the program.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct AutoLength(pub(crate) Option<f64>);

impl FromStr for AutoLength {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "auto" { Ok(Self(None)) } else { length_m(text).map(|m| Self(Some(m))) }
    }
}

/// The length of a segment, which may be left to the program: `12m` or `12` of the way, `2s` of time, `30scans`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct AutoSegment(pub(crate) Option<SegmentLength>);

impl FromStr for AutoSegment {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let bad = || format!("`{text}` is no length of a segment: try auto, 12m, 2s or 30scans");
        let number = |text: &str| text.trim_end().parse::<f64>().ok().filter(|n| n.is_finite());
        if text == "auto" {
            return Ok(Self(None));
        }
        if let Some(scans) = text.strip_suffix("scans").or_else(|| text.strip_suffix("scan")) {
            let scans = scans.trim_end().parse().map_err(|_| bad())?;
            return Ok(Self(Some(SegmentLength::Scans(scans))));
        }
        if let Some(seconds) = text.strip_suffix('s').and_then(number) {
            return Ok(Self(Some(SegmentLength::Seconds(seconds))));
        }
        length_m(text).map(|m| Self(Some(SegmentLength::Metres(m)))).map_err(|_| bad())
    }
}

/// The lengths by which returns are judged, which may be left to the log's sensor.
pub(crate) fn scales(text: &str) -> Result<Option<Scales>, String> {
    if text == "auto" {
        return Ok(None);
    }
    Scales::named(text).map(Some).ok_or_else(|| {
        let names: Vec<_> = Scales::ALL.iter().map(|(_, lengths)| lengths.name).collect();
        format!("`{text}` are no lengths that are known: try auto, {}", names.join(" or "))
    })
}

/// The unit of a map, which may be left to its file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct AutoUnit(pub(crate) Option<LengthUnit>);

impl FromStr for AutoUnit {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Ok(Self(match text {
            "auto" => None,
            "m" => Some(LengthUnit::Metre),
            "ft" => Some(LengthUnit::Foot),
            "us-ft" => Some(LengthUnit::UsSurveyFoot),
            _ => return Err(format!("`{text}` is no unit: try auto, m, ft or us-ft")),
        }))
    }
}

/// A number of bytes with its unit: `2GiB`, `500MB`, `unlimited`.
pub(crate) fn memory_bytes(text: &str) -> Result<usize, String> {
    const UNITS: [(&str, f64); 9] = [
        ("KiB", 1024.0),
        ("MiB", 1_048_576.0),
        ("GiB", 1_073_741_824.0),
        ("TiB", 1_099_511_627_776.0),
        ("kB", 1e3),
        ("MB", 1e6),
        ("GB", 1e9),
        ("TB", 1e12),
        ("B", 1.0),
    ];
    if text == "unlimited" {
        return Ok(UNLIMITED_BYTES);
    }
    let unit_at = text.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(text.len());
    let (number, unit) = text.split_at(unit_at);
    let factor = UNITS.iter().find(|(name, _)| name.eq_ignore_ascii_case(unit)).map(|&(_, factor)| factor);
    let bytes = factor.zip(number.trim_end().parse::<f64>().ok()).map(|(factor, number)| factor * number);
    match bytes {
        Some(bytes) if (0.0..=UNLIMITED_BYTES as f64).contains(&bytes) => Ok(bytes as usize),
        _ => Err(format!("`{text}` is no amount of memory: try 2GiB, 500MB or unlimited")),
    }
}

/// A time after which something is done again, which may be never.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Every(pub(crate) Option<Duration>);

impl FromStr for Every {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let seconds = match text {
            "none" => return Ok(Self(None)),
            _ => text.parse::<f64>().ok().filter(|seconds| (0.0..=1e6).contains(seconds)),
        };
        let seconds = seconds.ok_or_else(|| format!("`{text}` is no time: try 30 (seconds) or none"))?;
        Ok(Self(Some(Duration::from_secs_f64(seconds))))
    }
}

/// A transform, `x,y,z,qx,qy,qz,qw`.
pub(crate) fn transform(text: &str) -> Result<Isometry3<f64>, String> {
    let expected = "x,y,z,qx,qy,qz,qw or auto, identity, calib, calib:FILE, frame:NAME";
    let [x, y, z, qx, qy, qz, qw] = numbers(text, expected)?;
    let quaternion = Quaternion::new(qw, qx, qy, qz);
    let norm = quaternion.norm();
    // Compares as false for NaN.
    if (norm - 1.0).abs() <= NORM_TOLERANCE {
        Ok(Isometry3::from_parts(Translation3::new(x, y, z), UnitQuaternion::from_quaternion(quaternion)))
    } else {
        Err(format!(
            "the quaternion {qx},{qy},{qz},{qw} has the length {norm:.4}, not 1: the order is qx,qy,qz,qw"
        ))
    }
}

/// A share from 0 to 1, to the nearest thousandth.
pub(crate) fn miss_price(text: &str) -> Result<MissPrice, String> {
    let share = text.trim().parse().ok().and_then(MissPrice::new);
    share.ok_or_else(|| format!("`{text}` is no share from 0 to 1"))
}

/// `auto`, `none`, or a box `xmin,ymin,zmin,xmax,ymax,zmax` in metres.
pub(crate) fn ego(text: &str) -> Result<Ego, String> {
    match text {
        "auto" => return Ok(Ego::Auto),
        "none" => return Ok(Ego::None),
        _ => {}
    }
    let corners: [f64; 6] = numbers(text, "auto, none or xmin,ymin,zmin,xmax,ymax,zmax")?;
    let [x0, y0, z0, x1, y1, z1] = corners.map(|m| (1e3 * m).round() as i64);
    if x0 < x1 && y0 < y1 && z0 < z1 {
        Ok(Ego::BoxMm([x0, y0, z0], [x1, y1, z1]))
    } else {
        Err(format!("`{text}`: each of xmin,ymin,zmin must be smaller than its xmax,ymax,zmax"))
    }
}

/// Seconds to the nanosecond, without a way through `f64`, which keeps only 240 ns of today's dates.
pub(crate) fn seconds_ns(text: &str) -> Result<i64, String> {
    let error = || format!("`{text}` is no number of seconds: try -18 or 1600000000.25");
    let unsigned = text.strip_prefix(['-', '+']).unwrap_or(text);
    let (whole, part) = unsigned.split_once('.').unwrap_or((unsigned, ""));
    let digits = |text: &str| text.bytes().all(|c| c.is_ascii_digit());
    if (whole.is_empty() && part.is_empty()) || !digits(whole) || !digits(part) || part.len() > 9 {
        return Err(error());
    }
    let ns = format!("{whole}{part:0<9}").parse::<i64>().map_err(|_| error())?;
    Ok(if text.starts_with('-') { -ns } else { ns })
}

/// `N` finite numbers with commas between them.
fn numbers<const N: usize>(text: &str, expected: &str) -> Result<[f64; N], String> {
    let parts: Vec<&str> = text.split(',').collect();
    let mut values = [0.0; N];
    if parts.len() != N {
        return Err(format!("`{text}` has {} of {N} numbers: expected {expected}", parts.len()));
    }
    for (value, part) in values.iter_mut().zip(parts) {
        let number = part.trim().parse::<f64>().ok().filter(|number| number.is_finite());
        *value = number.ok_or_else(|| format!("`{part}` is no finite number: expected {expected}"))?;
    }
    Ok(values)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn checkpoints_may_be_left_out() {
        assert_eq!("none".parse(), Ok(Every(None)));
        assert_eq!("0.5".parse(), Ok(Every(Some(Duration::from_millis(500)))));
        for text in ["", "-1", "nan", "1s", "inf", "1e300"] {
            assert!(text.parse::<Every>().is_err(), "{text}");
        }
    }

    #[test]
    fn amounts_of_memory_have_units() {
        let cases =
            [("2GiB", 2 << 30), ("1.5 KiB", 1536), ("500MB", 500_000_000), ("32mib", 32 << 20), ("7B", 7)];
        for (text, bytes) in cases {
            assert_eq!(memory_bytes(text), Ok(bytes), "{text}");
        }
        assert_eq!(memory_bytes("unlimited"), Ok(UNLIMITED_BYTES));
        for text in ["2", "2G", "GiB", "-1GiB", "nanB", "1e30TB", "", "2GiBs", "2 Gi B"] {
            assert!(memory_bytes(text).is_err_and(|e| e.contains("try 2GiB")), "{text}");
        }
    }

    #[test]
    fn a_transform_is_seven_numbers_and_a_rotation() {
        assert_eq!(transform("0,0,0,0,0,0,1"), Ok(Isometry3::identity()));
        let half_turn = transform("1,-2.5, 3,0,0,1,0").unwrap();
        assert_eq!(half_turn.translation.vector.as_slice(), [1.0, -2.5, 3.0]);
        assert!((half_turn.rotation.angle() - std::f64::consts::PI).abs() < 1e-12);
        let typed = transform("0,0,0,0,0,0.707,0.707").unwrap();
        assert!((typed.rotation.norm() - 1.0).abs() < 1e-12);
        let bad = [
            ("0,0,0,0,0,0,0", "length 0.0000"),
            ("0,0,0,0,0,0,2", "length 2.0000"),
            ("0,0,0,0,0,0", "6 of 7"),
            ("0,0,0,0,0,0,1,0", "8 of 7"),
            ("nan,0,0,0,0,0,1", "`nan`"),
            ("0,0,inf,0,0,0,1", "`inf`"),
            ("0,0,1e999,0,0,0,1", "`1e999`"),
            ("unit", "1 of 7"),
        ];
        for (text, part) in bad {
            assert!(transform(text).is_err_and(|e| e.contains(part)), "{text}");
        }
    }

    #[test]
    fn the_price_of_a_miss_is_a_share() {
        for (text, share) in [("0", 0.0), ("0.25", 0.25), ("1", 1.0), (" 0.1 ", 0.1), ("0.12345", 0.123)] {
            assert_eq!(miss_price(text).map(Some), Ok(MissPrice::new(share)), "{text}");
        }
        for text in ["-0.1", "1.5", "nan", "inf", "x", "", "15%"] {
            assert_eq!(miss_price(text), Err(format!("`{text}` is no share from 0 to 1")));
        }
    }

    #[test]
    fn a_vehicle_is_a_box_with_an_inside() {
        assert_eq!(ego("auto"), Ok(Ego::Auto));
        assert_eq!(ego("none"), Ok(Ego::None));
        assert_eq!(ego("-1.2345,-1,-2,1,1,0.5"), Ok(Ego::BoxMm([-1235, -1000, -2000], [1000, 1000, 500])));
        assert!(ego("1,-1,-2,-1,1,0").is_err_and(|e| e.contains("smaller")));
        assert!(ego("0,0,0,1,1,0").is_err_and(|e| e.contains("smaller")));
        assert!(ego("0,0,0,1,1").is_err_and(|e| e.contains("5 of 6")));
    }

    #[test]
    fn lengths_may_be_left_to_the_program() {
        assert_eq!("auto".parse(), Ok(AutoLength(None)));
        assert_eq!("12m".parse(), Ok(AutoLength(Some(12.0))));
        assert_eq!("0.2".parse(), Ok(AutoLength(Some(0.2))));
        assert!("12 miles".parse::<AutoLength>().is_err());
    }

    #[test]
    fn segments_are_of_way_time_or_scans() {
        for (text, length) in [
            ("auto", None),
            ("12", Some(SegmentLength::Metres(12.0))),
            ("60cm", Some(SegmentLength::Metres(0.6))),
            ("2s", Some(SegmentLength::Seconds(2.0))),
            ("0.5 s", Some(SegmentLength::Seconds(0.5))),
            ("30scans", Some(SegmentLength::Scans(30))),
            ("1 scan", Some(SegmentLength::Scans(1))),
        ] {
            assert_eq!(text.parse(), Ok(AutoSegment(length)), "{text}");
        }
        for text in ["s", "12 miles", "-3scans", "1.5scans", "nans", ""] {
            let error = text.parse::<AutoSegment>().unwrap_err();
            assert!(error.starts_with(&format!("`{text}` is no length of a segment")), "{error}");
        }
        assert_eq!((scales("auto"), scales("room")), (Ok(None), Ok(Some(Scales::Room))));
        assert!(scales("hall").unwrap_err().starts_with("`hall` are no lengths"));
    }

    #[test]
    fn seconds_are_exact() {
        let cases = [
            ("0", 0),
            ("-18", -18_000_000_000),
            ("+.5", 500_000_000),
            ("1690309709.285305501", 1_690_309_709_285_305_501),
            ("-1600000000.25", -1_600_000_000_250_000_000),
            ("3.", 3_000_000_000),
        ];
        for (text, ns) in cases {
            assert_eq!(seconds_ns(text), Ok(ns), "{text}");
        }
        for text in ["", ".", "-", "--1", "1e3", "0.1234567891", "9999999999999", "1,5", "x", "1.2.3", "+-1"]
        {
            assert!(seconds_ns(text).is_err(), "{text}");
        }
    }
}
