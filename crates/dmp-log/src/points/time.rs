//! What the user says of the times of points: in which unit, and counted from where.

use std::fmt;
use std::str::FromStr;

/// A unit of time. As text (`FromStr`): `s`, `ms`, `us`, `ns`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
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
    /// Every unit.
    pub const ALL: [Self; 4] = [Self::Seconds, Self::Milliseconds, Self::Microseconds, Self::Nanoseconds];

    /// Its symbol, its name, nanoseconds in it, and how many decimals a nanosecond has in it.
    fn table(self) -> (&'static str, &'static str, i64, i32) {
        match self {
            Self::Seconds => ("s", "seconds", 1_000_000_000, 9),
            Self::Milliseconds => ("ms", "milliseconds", 1_000_000, 6),
            Self::Microseconds => ("us", "microseconds", 1_000, 3),
            Self::Nanoseconds => ("ns", "nanoseconds", 1, 0),
        }
    }

    /// Nanoseconds in it.
    pub fn in_ns(self) -> i64 {
        self.table().2
    }

    pub(crate) fn decimals_of_ns(self) -> i32 {
        self.table().3
    }

    /// As it is written: `s`, `ms`, `us`, `ns`.
    pub fn symbol(self) -> &'static str {
        self.table().0
    }

    /// In words, `seconds`.
    pub fn name(self) -> &'static str {
        self.table().1
    }
}

impl FromStr for TimeUnit {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|unit| unit.symbol() == text);
        found.ok_or_else(|| format!("`{text}` is no unit of time: it is s, ms, us or ns"))
    }
}

/// What the user says about the times of the points.
///
/// As text: `auto`, `ignore`, `s`, `ms`, `us`, `ns` (after the scan's stamp), `absolute-s`, … (on the clock
/// of the stamps), `first-s`, … (on a clock of their own: after the first point of the scan).
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
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
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_option_is_read_as_it_is_written() {
        let all = "auto ignore s ms us ns absolute-s absolute-ms absolute-us absolute-ns first-s first-ms first-us first-ns";
        for text in all.split(' ') {
            assert_eq!(text.parse::<PointTime>().unwrap().to_string(), text);
        }
        assert!("seconds".parse::<PointTime>().unwrap_err().contains("`seconds`"));
    }
}
