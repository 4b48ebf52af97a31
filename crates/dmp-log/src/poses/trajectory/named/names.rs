//! What the name of a column says is in it.

use crate::TimeUnit;

/// What a column holds.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Meaning {
    /// A stamp, or a part of one.
    Stamp(StampName),
    /// A coordinate of the place: 0 to 2 for x, y, z.
    Place(usize),
    /// A coordinate of the quaternion: 0 to 3 for x, y, z, w.
    Quaternion(usize),
    /// A coordinate of the place in another unit than metres.
    NotMetres(String),
}

/// The name of a column of stamps.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct StampName {
    /// Without its unit: two columns with the same, one of seconds and one of nanoseconds, are one stamp.
    pub(crate) base: String,
    /// Where the name has one.
    pub(crate) unit: Option<TimeUnit>,
    /// The smaller, the rather it is meant: the header of a message, some time, the time of recording.
    pub(crate) rank: u8,
}

const PLACES: [&str; 8] = ["", "t", "p", "pos", "position", "translation", "trans", "pose"];
const QUATERNIONS: [&str; 6] = ["q", "quat", "quaternion", "orientation", "rotation", "rot"];
/// Parts of messages; names of topics may stand before them.
const MESSAGE_PLACES: [&str; 2] = ["pose_position", "transform_translation"];
const MESSAGE_QUATERNIONS: [&str; 2] = ["pose_orientation", "transform_rotation"];
const STAMPS: [&str; 12] = [
    "",
    "time",
    "timestamp",
    "stamp",
    "t",
    "header_stamp",
    "rosbagtimestamp",
    "unix_time",
    "ros_time",
    "utime",
    "gpstime",
    "gps_time",
];
const LENGTHS: [&str; 7] = ["m", "meter", "meters", "metre", "metres", "mm", "cm"];

/// The axis of a place by the words of surveyors, of which no pose is made where x, y and z are there, too.
pub(crate) fn surveyed_axis(name: &str) -> Option<usize> {
    const AXES: [&[&str]; 3] = [
        &["e", "east", "easting", "utm_east", "utm_easting"],
        &["n", "north", "northing", "utm_north", "utm_northing"],
        &["h", "u", "up", "height", "alt", "altitude", "elevation"],
    ];
    let (words, unit) = words(name);
    let (last, rest) = words.split_last()?;
    let words = if !rest.is_empty() && last == "m" { rest } else { &words[..] };
    let is_metres = unit.is_none_or(|unit| ["", "m"].contains(&unit.as_str()));
    AXES.iter().position(|names| is_metres && names.contains(&words.join("_").as_str()))
}

/// Whether a name is that of a number of places, which pairs them where they have no stamps.
pub(crate) fn is_number(name: &str) -> bool {
    ["id", "index", "frame", "point", "no", "nr", "number"].contains(&words(name).0.join("_").as_str())
}

/// Whether a name is that of an Euler angle.
pub(crate) fn is_angle(name: &str) -> bool {
    let words = words(name).0;
    words.iter().any(|word| ["roll", "pitch", "yaw", "heading"].contains(&word.as_str()))
}

/// What a name says; nothing for columns that are not used.
pub(crate) fn meaning(name: &str) -> Option<Meaning> {
    let (words, bracketed) = words(name);
    let unit = bracketed.as_deref();
    if let Some(stamp) = stamp(name, &words, unit) {
        return Some(Meaning::Stamp(stamp));
    }
    let (last, rest) = words.split_last()?;
    let (words, unit) = match unit {
        None if !rest.is_empty() && LENGTHS.contains(&last.as_str()) => (rest, Some(last.as_str())),
        unit => (&words[..], unit),
    };
    let (prefix, axis) = axis(words)?;
    // Lists of poses are of several bodies.
    if words.iter().any(|word| word.starts_with("poses") || word.starts_with("transforms")) {
        return None;
    }
    let is = |names: &[&str], parts: [&str; 2], frames: &str| {
        names.contains(&prefix.as_str())
            || prefix.starts_with(frames)
            || parts.iter().any(|part| prefix == *part || prefix.ends_with(&format!("_{part}")))
    };
    if is(&QUATERNIONS, MESSAGE_QUATERNIONS, "q_") {
        return Some(Meaning::Quaternion(axis));
    }
    (axis < 3 && is(&PLACES, MESSAGE_PLACES, "p_")).then(|| match unit {
        Some(unit) if !unit.is_empty() && !LENGTHS[..5].contains(&unit) => {
            Meaning::NotMetres(name.to_owned())
        }
        _ => Meaning::Place(axis),
    })
}

/// The words of a name in small letters, and what stands in brackets at its end.
fn words(name: &str) -> (Vec<String>, Option<String>) {
    let name = name.to_lowercase();
    let (name, unit) = match name.find(['[', '(']) {
        Some(at) if at > 0 => {
            let (name, unit) = name.split_at(at);
            (name, Some(unit.trim_matches(|c: char| "[]()- ".contains(c)).to_owned()))
        }
        _ => (name.as_str(), None),
    };
    let words = name.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty());
    (words.map(str::to_owned).collect(), unit)
}

/// The axis that a name ends in, and what stands before it: `position_x`, `px`, `posX`.
fn axis(words: &[String]) -> Option<(String, usize)> {
    let (last, rest) = words.split_last()?;
    let at = last.len().checked_sub(1).filter(|&at| last.is_char_boundary(at))?;
    let (stem, axis) = last.split_at(at);
    let axis = ["x", "y", "z", "w"].iter().position(|name| *name == axis)?;
    let is_stem = stem.is_empty() || PLACES.contains(&stem) || QUATERNIONS.contains(&stem);
    let stem = (!stem.is_empty()).then(|| stem.to_owned());
    is_stem.then(|| (rest.iter().cloned().chain(stem).collect::<Vec<_>>().join("_"), axis))
}

fn time_unit(word: &str) -> Option<TimeUnit> {
    Some(match word {
        "s" | "sec" | "secs" | "second" | "seconds" => TimeUnit::Seconds,
        "ms" | "msec" | "msecs" | "millis" | "milliseconds" => TimeUnit::Milliseconds,
        "us" | "µs" | "usec" | "usecs" | "micros" | "microseconds" => TimeUnit::Microseconds,
        "ns" | "nsec" | "nsecs" | "nanosec" | "nanosecs" | "nanos" | "nanoseconds" => TimeUnit::Nanoseconds,
        _ => return None,
    })
}

fn stamp(name: &str, words: &[String], bracketed: Option<&str>) -> Option<StampName> {
    let (last, rest) = words.split_last()?;
    let (base, unit) = match time_unit(last) {
        Some(unit) => (rest.join("_"), Some(unit)),
        None => (words.join("_"), bracketed.and_then(time_unit)),
    };
    let is_header = base == "header_stamp" || base.ends_with("_header_stamp");
    if !is_header && !STAMPS.contains(&base.as_str()) {
        return None;
    }
    // The times of recording that `rostopic echo -p` and bags have beside those of the messages.
    let is_recording = name.trim_start().starts_with('%') || base == "rosbagtimestamp";
    Some(StampName { base, unit, rank: if is_header { 0 } else { 1 + u8::from(is_recording) } })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_and_quaternions_have_many_names() {
        let places = "{}|t{}|p{}|pos_{}|position.{}|p_RS_R_{} [m]|{} (m)|{}_m|translation_{}|\
            field.pose.pose.position.{}|pose.position.{}|/odom/pose/pose/position/{}|pos{}";
        for prefix in places.split('|') {
            for (k, axis) in ["x", "y", "z"].iter().enumerate() {
                for name in [prefix.replace("{}", axis), prefix.replace("{}", axis).to_uppercase()] {
                    assert_eq!(meaning(&name), Some(Meaning::Place(k)), "{name}");
                }
            }
        }
        let quaternions =
            "q{}|q_{}|quat_{}|q_RS_{} []|orientation.{}|rot_{}|field.pose.pose.orientation.{}|quat{}";
        for prefix in quaternions.split('|') {
            for (k, axis) in ["x", "y", "z", "w"].iter().enumerate() {
                let name = prefix.replace("{}", axis);
                assert_eq!(meaning(&name), Some(Meaning::Quaternion(k)), "{name}");
            }
        }
    }

    #[test]
    fn what_is_no_pose_is_not_used() {
        let others = "|w|id|vx|v_RS_R_x [m s^-1]|b_w_RS_S_x [rad s^-1]|field.twist.twist.linear.x|\
            field.twist.twist.angular.z|field.pose.covariance0|field.header.seq|field.header.frame_id|\
            field.poses0.pose.position.x|field.transforms0.transform.translation.x|roll|q0|max|é";
        for name in others.split('|') {
            assert_eq!(meaning(name), None, "{name}");
        }
        assert!(matches!(meaning("x [mm]"), Some(Meaning::NotMetres(_))));
        assert!(matches!(meaning("pos_x_mm"), Some(Meaning::NotMetres(_))));
    }

    #[test]
    fn stamps_have_units_and_ranks() {
        let of = |name: &str| match meaning(name) {
            Some(Meaning::Stamp(StampName { base, unit, rank })) => (base, unit, rank),
            other => panic!("{name}: {other:?}"),
        };
        assert_eq!(of("timestamp"), ("timestamp".into(), None, 1));
        assert_eq!(of("#timestamp [ns]"), ("timestamp".into(), Some(TimeUnit::Nanoseconds), 1));
        assert_eq!(of("time_ms"), ("time".into(), Some(TimeUnit::Milliseconds), 1));
        assert_eq!(of("Time(s)"), ("time".into(), Some(TimeUnit::Seconds), 1));
        assert_eq!(of("%time"), ("time".into(), None, 2));
        assert_eq!(of("field.header.stamp"), ("field_header_stamp".into(), None, 0));
        assert_eq!(of("secs"), (String::new(), Some(TimeUnit::Seconds), 1));
        assert_eq!(of("header.stamp.nsecs"), ("header_stamp".into(), Some(TimeUnit::Nanoseconds), 0));
    }
}
