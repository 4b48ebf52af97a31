//! Values on the command line: text with units, as the types that the settings have.

use std::str::FromStr;
use std::time::Duration;

use dmp::{CastReturns, Confidence, DriftPairs, Ego, LengthUnit, PosesAs, Scales, SegmentLength};
use dmp_log::{TimeUnit, TrajectoryFormat};
use dmp_sensor::{Isometry3, Quaternion, Translation3, UnitQuaternion};

/// What `--memory unlimited` stands for, bytes: more than any machine has, and exact in every JSON reader.
const UNLIMITED_BYTES: usize = 1 << 52;
/// How far the norm of a quaternion may be from 1: numbers are typed with few digits.
const NORM_TOLERANCE: f64 = 0.02;

/// What a type reads of itself.
pub(crate) fn parsed<T: FromStr>(text: &str) -> Result<T, String>
where
    T::Err: ToString,
{
    text.parse().map_err(|error: T::Err| error.to_string())
}

/// A number of 1 or more.
pub(crate) fn from_one<T: FromStr + PartialOrd + From<u8>>(text: &str) -> Result<T, String> {
    let number = text.parse().ok().filter(|number| *number >= T::from(1));
    number.ok_or_else(|| format!("`{text}` is not a whole number of 1 or more"))
}

/// `auto`, or a value.
fn or_auto<T>(text: &str, parse: fn(&str) -> Result<T, String>) -> Result<Option<T>, String> {
    if text == "auto" { Ok(None) } else { parse(text).map(Some) }
}

/// A length in metres: `0.03`, `0.03m`, `3cm`, `30mm`.
pub(crate) fn length_m(text: &str) -> Result<f64, String> {
    let units = [("mm", 1e-3), ("cm", 1e-2), ("m", 1.0)];
    quantity(text, &units, Some(1.0)).ok_or_else(|| format!("`{text}` is no length: try 0.03, 3cm or 30mm"))
}

/// The same, or `auto`.
pub(crate) fn auto_length(text: &str) -> Result<Option<f64>, String> {
    or_auto(text, length_m)
}

/// Lengths with commas between them.
pub(crate) fn lengths_m(text: &str) -> Result<Vec<f64>, String> {
    text.split(',').map(length_m).collect()
}

/// An angle in radians: `0.1deg`, `2mrad`, `0.002rad`. The unit must be given.
pub(crate) fn angle_rad(text: &str) -> Result<f64, String> {
    let units = [("deg", std::f64::consts::PI / 180.0), ("mrad", 1e-3), ("rad", 1.0)];
    quantity(text, &units, None).ok_or_else(|| format!("`{text}` is no angle: try 0.1deg or 2mrad"))
}

/// Noise of position and rotation, `0.03,0.1deg`; the second is optional.
pub(crate) fn noise(text: &str) -> Result<(f64, f64), String> {
    match text.split_once(',') {
        Some((length, angle)) => Ok((length_m(length.trim())?, angle_rad(angle.trim())?)),
        None => Ok((length_m(text)?, 0.0)),
    }
}

/// Standard deviations of position and rotation, `1cm,1mrad`, both above 0.
pub(crate) fn errors(text: &str) -> Result<(f64, f64), String> {
    let both = text.split_once(',').ok_or_else(|| format!("`{text}` are no errors: try 1cm,1mrad"))?;
    let errors = (length_m(both.0.trim())?, angle_rad(both.1.trim())?);
    let are_positive = errors.0 > 0.0 && errors.1 > 0.0;
    if are_positive { Ok(errors) } else { Err(format!("`{text}` must both be above 0: try 1cm,1mrad")) }
}

/// Two elevations in degrees, lowest first: `-15,15`. In radians.
pub(crate) fn elevations_rad(text: &str) -> Result<[f64; 2], String> {
    let bad = || format!("`{text}` are no two elevations in degrees: try -15,15");
    let (low, high) = text.split_once(',').ok_or_else(bad)?;
    let degrees = |text: &str| quantity(text.trim(), &[("deg", 1.0)], Some(1.0)).ok_or_else(bad);
    Ok([degrees(low)?.to_radians(), degrees(high)?.to_radians()])
}

/// A time in nanoseconds: `0.1`, `0.1s`, `100ms`.
pub(crate) fn interval_ns(text: &str) -> Result<i64, String> {
    let seconds = quantity(text, &[("ms", 1e-3), ("s", 1.0)], Some(1.0)).filter(|s| (1e-9..1e6).contains(s));
    Ok((seconds.ok_or_else(|| format!("`{text}` is no time: try 0.1s or 100ms"))? * 1e9).round() as i64)
}

/// Seconds to the nanosecond, not by way of `f64`, which keeps only 240 ns of today's dates.
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

/// An offset of clocks: of [`seconds_ns`], as a type of its own so that a run may be named before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Offset(pub(crate) i64);

impl FromStr for Offset {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        seconds_ns(text).map(Self)
    }
}

/// What is known of the poses in a run's file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Poses {
    Format(TrajectoryFormat),
    /// The unit of their stamps: `stamps-us`.
    Stamps(TimeUnit),
    As(PosesAs),
}

impl FromStr for Poses {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let unit = text.strip_prefix("stamps-").and_then(|unit| unit.parse().ok()).map(Self::Stamps);
        let meant = || text.parse().ok().map(Self::As);
        let format = || text.parse().ok().map(Self::Format);
        unit.or_else(meant).or_else(format).ok_or_else(|| {
            let formats = TrajectoryFormat::ALL.map(|format| format.to_string()).join(", ");
            format!(
                "`{text}` is not known: try {formats}, stamps-s, stamps-ms, stamps-us, stamps-ns, {}",
                PosesAs::names()
            )
        })
    }
}

/// The length of a segment, or `auto`: `12m` or `12` of the path, `2s`, `30scans`.
pub(crate) fn segment(text: &str) -> Result<Option<SegmentLength>, String> {
    let bad = || format!("`{text}` is no length of a segment: try auto, 12m, 2s or 30scans");
    let number = |text: &str| text.trim_end().parse::<f64>().ok().filter(|n| n.is_finite());
    if text == "auto" {
        return Ok(None);
    }
    if let Some(scans) = text.strip_suffix("scans").or_else(|| text.strip_suffix("scan")) {
        let scans = scans.trim_end().parse().map_err(|_| bad())?;
        return Ok(Some(SegmentLength::Scans(scans)));
    }
    if let Some(seconds) = text.strip_suffix('s').and_then(number) {
        return Ok(Some(SegmentLength::Seconds(seconds)));
    }
    length_m(text).map(|m| Some(SegmentLength::Metres(m))).map_err(|_| bad())
}

/// `auto`, `drive` or `room`.
pub(crate) fn scales(text: &str) -> Result<Option<Scales>, String> {
    or_auto(text, |text| {
        Scales::named(text).ok_or_else(|| {
            let names: Vec<_> = Scales::ALL.iter().map(|(_, lengths)| lengths.name).collect();
            format!("`{text}` are no scales: try auto, {}", names.join(" or "))
        })
    })
}

/// The unit of a map, or `auto`.
pub(crate) fn unit(text: &str) -> Result<Option<LengthUnit>, String> {
    or_auto(text, |text| match text {
        "m" => Ok(LengthUnit::Metre),
        "ft" => Ok(LengthUnit::Foot),
        "us-ft" => Ok(LengthUnit::UsSurveyFoot),
        _ => Err(format!("`{text}` is no unit: try auto, m, ft or us-ft")),
    })
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

/// A time in seconds after which something is done again, or `none`.
pub(crate) fn every(text: &str) -> Result<Option<Duration>, String> {
    if text == "none" {
        return Ok(None);
    }
    let seconds = text.parse::<f64>().ok().filter(|seconds| (0.0..=1e6).contains(seconds));
    let seconds = seconds.ok_or_else(|| format!("`{text}` is no time: try 30 (seconds) or none"))?;
    Ok(Some(Duration::from_secs_f64(seconds)))
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

/// A rectangle, `xmin,ymin,xmax,ymax` in metres.
pub(crate) fn rectangle(text: &str) -> Result<[f64; 4], String> {
    let error = || format!("`{text}` is no box: try -20,-20,40,40 for XMIN,YMIN,XMAX,YMAX");
    let [x0, y0, x1, y1] = numbers(text, "").map_err(|_| error())?;
    if x0 < x1 && y0 < y1 { Ok([x0, y0, x1, y1]) } else { Err(error()) }
}

/// Two counts of pixels: `640x480`.
pub(crate) fn size_px(text: &str) -> Result<[u32; 2], String> {
    let parse = |text: &str| text.trim().parse::<u32>().ok();
    let both = text.split_once('x').and_then(|(w, h)| Some([parse(w)?, parse(h)?]));
    both.ok_or_else(|| format!("`{text}` is no size in pixels: try 640x480"))
}

/// Three lengths in metres: `7x5.6x2.6`.
pub(crate) fn room_m(text: &str) -> Result<[f64; 3], String> {
    let all: Option<Vec<f64>> = text.split('x').map(|part| part.trim().parse().ok()).collect();
    all.and_then(|all| all.try_into().ok())
        .ok_or_else(|| format!("`{text}` are no width, depth and height in metres: try 7x5.6x2.6"))
}

/// `99%`, as a share.
fn share(text: &str) -> Option<f64> {
    let percent = text.strip_suffix('%')?.trim_end().parse::<f64>().ok()?;
    percent.is_finite().then_some(percent / 100.0)
}

/// `all` or `1/8`.
pub(crate) fn returns(text: &str) -> Result<CastReturns, String> {
    let one_in = if text == "all" { Some(1) } else { text.strip_prefix("1/").and_then(|n| n.parse().ok()) };
    let error = || format!("`{text}` is no share of the returns: try all or 1/8 (to 1/1000)");
    one_in.filter(|n| (1..=1000).contains(n)).map(CastReturns::OneIn).ok_or_else(error)
}

/// `99%` or `0.99`.
pub(crate) fn confidence(text: &str) -> Result<Confidence, String> {
    let level = if text.ends_with('%') { share(text) } else { text.parse().ok() };
    let error = || format!("`{text}` is no confidence: try 99% (from 50% to below 100%)");
    level.and_then(Confidence::new).ok_or_else(error)
}

/// A number of pairs of visits, `all` or `none`.
pub(crate) fn drift_pairs(text: &str) -> Result<DriftPairs, String> {
    match text.parse() {
        _ if text == "all" => Ok(DriftPairs::All),
        _ if text == "none" => Ok(DriftPairs::None),
        Ok(count) if count > 0 => Ok(DriftPairs::AtMost(count)),
        _ => Err("it must be a number of pairs of 1 or more, `all` or `none`".to_owned()),
    }
}

/// The same without `none`.
pub(crate) fn some_pairs(text: &str) -> Result<DriftPairs, String> {
    let pairs = drift_pairs(text).ok().filter(|pairs| *pairs != DriftPairs::None);
    pairs.ok_or_else(|| "it must be a number of pairs of 1 or more, or `all`".to_owned())
}

/// Two runs by their names; nothing: all of them.
pub(crate) fn pair(text: &str) -> Result<Option<(String, String)>, String> {
    if text.is_empty() {
        return Ok(None);
    }
    match text.split_once(',').filter(|(a, b)| !a.is_empty() && !b.is_empty() && !b.contains(',')) {
        Some((a, b)) => Ok(Some((a.to_owned(), b.to_owned()))),
        None => Err("the names of two runs with a comma between them are expected".to_owned()),
    }
}

/// A finite number with one of the units, the longer names first, or with none where that has a meaning.
fn quantity(text: &str, units: &[(&str, f64)], without: Option<f64>) -> Option<f64> {
    let with_unit = units.iter().find_map(|&(name, factor)| Some((text.strip_suffix(name)?, factor)));
    let (number, factor) = with_unit.or(without.map(|factor| (text, factor)))?;
    let value = number.trim_end().parse::<f64>().ok()? * factor;
    value.is_finite().then_some(value)
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
    use std::f64::consts::{FRAC_PI_2, PI};
    use std::fmt::Debug;

    use super::*;

    /// Texts that are understood, and texts that are refused with these words.
    fn check<T: PartialEq + Debug>(
        parse: fn(&str) -> Result<T, String>,
        good: &[(&str, T)],
        bad: &[&str],
        words: &str,
    ) {
        for (text, value) in good {
            assert_eq!(parse(text).as_ref(), Ok(value), "{text}");
        }
        for text in bad {
            assert!(parse(text).is_err_and(|error| error.contains(words)), "{text}");
        }
    }

    #[test]
    fn quantities_have_units() {
        check(noise, &[("0.03,0.1deg", (0.03, 0.1 * PI / 180.0)), ("3cm, 2mrad", (0.03, 0.002))], &[], "");
        check(noise, &[("0.5", (0.5, 0.0))], &["0.03,0.1", "0.03,deg", "x", "", "inf", "nan,0.1deg"], "try");
        check(errors, &[("1cm,1mrad", (0.01, 0.001))], &["1cm", "0,1mrad", "1cm,-1deg", "1cm,1"], "try");
        check(length_m, &[("-30mm", -0.03)], &["12 miles"], "try 0.03");
        check(auto_length, &[("auto", None), ("12m", Some(12.0)), ("0.2", Some(0.2))], &["12 miles"], "try");
        check(elevations_rad, &[("-90,90", [-FRAC_PI_2, FRAC_PI_2])], &["15"], "try -15,15");
        let times = [("100ms", 100_000_000), ("0.5", 500_000_000)];
        check(interval_ns, &times, &["-1s", "1e99", "1min"], "try 0.1s");
        let memory =
            [("2GiB", 2 << 30), ("1.5 KiB", 1536), ("500MB", 500_000_000), ("32mib", 32 << 20), ("7B", 7)];
        let bad = ["2", "2G", "GiB", "-1GiB", "nanB", "1e30TB", "", "2GiBs", "2 Gi B"];
        check(memory_bytes, &memory, &bad, "try 2GiB");
        check(memory_bytes, &[("unlimited", UNLIMITED_BYTES)], &[], "");
        let half = Some(Duration::from_millis(500));
        check(every, &[("none", None), ("0.5", half)], &["", "-1", "nan", "1s", "inf", "1e300"], "try 30");
        let rooms = ["7x5.6xfoox2.6", "7xx5.6x2.6", "640", ""];
        check(room_m, &[("8x6x2.5", [8.0, 6.0, 2.5])], &rooms, "try 7x5.6x2.6");
        check(size_px, &[("160x120", [160, 120])], &["640", "x480", "640x480x3", "-1x5"], "try 640x480");
    }

    #[test]
    fn a_transform_is_seven_numbers_and_a_rotation() {
        check(transform, &[("0,0,0,0,0,0,1", Isometry3::identity())], &[], "");
        let half_turn = transform("1,-2.5, 3,0,0,1,0").unwrap();
        assert_eq!(half_turn.translation.vector.as_slice(), [1.0, -2.5, 3.0]);
        assert!((half_turn.rotation.angle() - PI).abs() < 1e-12);
        let typed = transform("0,0,0,0,0,0.707,0.707").unwrap();
        assert!((typed.rotation.norm() - 1.0).abs() < 1e-12);
        for (text, part) in [
            ("0,0,0,0,0,0,0", "length 0.0000"),
            ("0,0,0,0,0,0,2", "length 2.0000"),
            ("0,0,0,0,0,0", "6 of 7"),
            ("0,0,0,0,0,0,1,0", "8 of 7"),
            ("nan,0,0,0,0,0,1", "`nan`"),
            ("0,0,1e999,0,0,0,1", "`1e999`"),
        ] {
            check(transform, &[], &[text], part);
        }
    }

    #[test]
    fn boxes_have_an_inside() {
        let boxed = Ego::BoxMm([-1235, -1000, -2000], [1000, 1000, 500]);
        let good = [("auto", Ego::Auto), ("none", Ego::None), ("-1.2345,-1,-2,1,1,0.5", boxed)];
        check(ego, &good, &["1,-1,-2,-1,1,0", "0,0,0,1,1,0"], "smaller");
        check(ego, &[], &["0,0,0,1,1"], "5 of 6");
        check(rectangle, &[("-1,-2,3,4", [-1.0, -2.0, 3.0, 4.0])], &["1,2,0,4", "1,2,3", "x"], "is no box");
    }

    #[test]
    fn words_are_known() {
        let good = [
            ("auto", None),
            ("12", Some(SegmentLength::Metres(12.0))),
            ("60cm", Some(SegmentLength::Metres(0.6))),
            ("0.5 s", Some(SegmentLength::Seconds(0.5))),
            ("30scans", Some(SegmentLength::Scans(30))),
            ("1 scan", Some(SegmentLength::Scans(1))),
        ];
        check(
            segment,
            &good,
            &["s", "12 miles", "-3scans", "1.5scans", "nans", ""],
            "is no length of a segment",
        );
        check(scales, &[("auto", None), ("room", Some(Scales::Room))], &["hall"], "`hall` are no scales");
        let both = Some(("a".to_owned(), "b".to_owned()));
        check(pair, &[("a,b", both), ("", None)], &["a", "a,b,c", ",b", "a,"], "two runs");
        let pairs = [("all", DriftPairs::All), ("3", DriftPairs::AtMost(3))];
        check(some_pairs, &pairs, &["none", "0", "-1", "x"], "or `all`");
        let poses = [
            ("euroc", Poses::Format(TrajectoryFormat::Euroc)),
            ("stamps-us", Poses::Stamps(TimeUnit::Microseconds)),
            ("inverted", Poses::As(PosesAs::Inverted)),
        ];
        check(parsed::<Poses>, &poses, &["", "us", "stamps-", "tumm"], "stamps-ms");
    }

    #[test]
    fn seconds_are_exact() {
        let good = [
            ("0", 0),
            ("-18", -18_000_000_000),
            ("+.5", 500_000_000),
            ("1690309709.285305501", 1_690_309_709_285_305_501),
            ("-1600000000.25", -1_600_000_000_250_000_000),
            ("3.", 3_000_000_000),
        ];
        let bad = ["", ".", "-", "--1", "1e3", "0.1234567891", "9999999999999", "1,5", "x", "1.2.3", "+-1"];
        check(seconds_ns, &good, &bad, "is no number of seconds");
    }
}
