//! Which fields of a point may hold its time, by their names.

use super::{Layout, TimeUnit};

/// The names under which drivers store the time of a point, the clearest first.
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

/// What fields of other names hold, by the words that their names begin with: no times.
const NO_TIMES: [&str; 24] = [
    "x",
    "y",
    "z",
    "i",
    "intensity",
    "reflect",
    "ring",
    "channel",
    "line",
    "tag",
    "range",
    "dist",
    "ambient",
    "noise",
    "near_ir",
    "signal",
    "azimuth",
    "elevation",
    "rgb",
    "normal",
    "label",
    "laser",
    "return",
    "_",
];

/// Between the names of two fields that are one time.
const AND: &str = " + ";

/// The fields of a layout that may hold the times of points.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct TimeFields {
    /// By their names, the clearest first: of two fields that are one time, known ones, and those that sound like it.
    pub(crate) named: Vec<String>,
    /// Of other names: only their values may say it.
    pub(crate) others: Vec<String>,
}

impl TimeFields {
    /// Those of a layout; where one is `asked` for, that one, if it is there.
    pub(crate) fn of(layout: &Layout, asked: Option<&str>) -> Self {
        let names = layout.names();
        if let Some(asked) = asked {
            let named = layout.time_field(asked).map(|_| asked.to_owned()).into_iter().collect();
            return Self { named, others: Vec::new() };
        }
        let named = candidates(&names);
        let is_other = |name: &&&str| {
            let name = name.to_lowercase();
            let in_two = named.iter().any(|two| two.split(AND).any(|one| one.to_lowercase() == name));
            !in_two && !NO_TIMES.iter().any(|no| no == &name || (no.len() > 1 && name.starts_with(no)))
        };
        let others = names.iter().filter(is_other).map(|&name| name.to_owned()).collect();
        Self { named, others }
    }

    /// All of them, in this order.
    pub(crate) fn all(&self) -> Vec<String> {
        [self.named.as_slice(), self.others.as_slice()].concat()
    }
}

/// Whether this is a name under which drivers store the time of a point: if its values are none, something is wrong.
pub(crate) fn is_time_name(name: &str) -> bool {
    FIELD_NAMES.contains(&name) || name.contains(AND)
}

/// The two names of a time in two fields, and the unit of the second one: the first has seconds.
pub(super) fn two_of(name: &str) -> Option<(&str, &str, TimeUnit)> {
    let (seconds, rest) = name.split_once('+')?;
    let (seconds, rest) = (seconds.trim(), rest.trim());
    Some((seconds, rest, unit_and_base(rest).map_or(TimeUnit::Nanoseconds, |(unit, _)| unit)))
}

/// The fields that may hold times by their names, the clearest first; then those that only sound like it, whose
/// values decide.
fn candidates(names: &[&str]) -> Vec<String> {
    let known = FIELD_NAMES.iter().filter(|wanted| names.contains(wanted));
    let sounds = |name: &str| {
        let name = name.to_ascii_lowercase();
        name.contains("time") || name.contains("stamp")
    };
    let like = names.iter().filter(|name| sounds(name) && !is_time_name(name));
    let one = known.chain(like).map(|&name| name.to_owned());
    in_two(names).into_iter().chain(one).collect()
}

/// Seconds in one field and what is below a second in another, by names that differ in nothing but the unit.
fn in_two(names: &[&str]) -> Vec<String> {
    let parts =
        || names.iter().filter_map(|name| unit_and_base(name).map(|(unit, base)| (*name, unit, base)));
    let seconds = parts().filter(|(_, unit, _)| *unit == TimeUnit::Seconds);
    let with_rest = |(name, _, base): (&str, TimeUnit, String)| {
        let rest = parts().find(|(_, unit, other)| *unit != TimeUnit::Seconds && *other == base)?;
        Some(format!("{name}{AND}{}", rest.0))
    };
    seconds.filter_map(with_rest).collect()
}

/// The unit that a name ends in, and what stands before it, in small letters.
fn unit_and_base(name: &str) -> Option<(TimeUnit, String)> {
    // A longer ending stands before those that it ends in.
    const ENDINGS: [(&str, TimeUnit); 18] = [
        ("nanoseconds", TimeUnit::Nanoseconds),
        ("nanosecond", TimeUnit::Nanoseconds),
        ("nanosecs", TimeUnit::Nanoseconds),
        ("nanosec", TimeUnit::Nanoseconds),
        ("nsecs", TimeUnit::Nanoseconds),
        ("nsec", TimeUnit::Nanoseconds),
        ("microseconds", TimeUnit::Microseconds),
        ("microsecond", TimeUnit::Microseconds),
        ("usecs", TimeUnit::Microseconds),
        ("usec", TimeUnit::Microseconds),
        ("seconds", TimeUnit::Seconds),
        ("second", TimeUnit::Seconds),
        ("secs", TimeUnit::Seconds),
        ("sec", TimeUnit::Seconds),
        // Of two letters at most: behind a stroke only.
        ("_ns", TimeUnit::Nanoseconds),
        ("_us", TimeUnit::Microseconds),
        ("_s", TimeUnit::Seconds),
        ("_n", TimeUnit::Nanoseconds),
    ];
    let name = name.to_lowercase();
    let (ending, unit) = ENDINGS.into_iter().find(|(ending, _)| name.ends_with(ending))?;
    Some((unit, name[..name.len() - ending.len()].trim_end_matches('_').to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_sound_like_times_come_last() {
        let names =
            ["x", "time_offset_ns", "intensity", "stamps", "t", "timestampSec", "rel_time", "Timestamp"];
        assert_eq!(
            candidates(&names),
            ["t", "time_offset_ns", "stamps", "timestampSec", "rel_time", "Timestamp"]
        );
    }

    #[test]
    fn two_fields_are_one_time_by_their_names() {
        for (names, one) in [
            (["timeSecond", "timeNanosecond"], Some("timeSecond + timeNanosecond")),
            (["nsec", "sec"], Some("sec + nsec")),
            (["t_sec", "t_nsec"], Some("t_sec + t_nsec")),
            (["timestamp_s", "timestamp_ns"], Some("timestamp_s + timestamp_ns")),
            (["tv_sec", "tv_usec"], Some("tv_sec + tv_usec")),
            (["stampSecs", "stampNanosecs"], Some("stampSecs + stampNanosecs")),
            (["start_sec", "end_nsec"], None),
            (["ambient", "label"], None),
        ] {
            assert_eq!(in_two(&names).first().map(String::as_str), one, "{names:?}");
        }
        assert_eq!(two_of("sec + usec"), Some(("sec", "usec", TimeUnit::Microseconds)));
        assert_eq!(two_of("a+b"), Some(("a", "b", TimeUnit::Nanoseconds)));
        assert_eq!(two_of("time"), None);
    }
}
