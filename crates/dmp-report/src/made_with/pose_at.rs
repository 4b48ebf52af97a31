//! The instant of a scan at which a pose holds.

use std::fmt;
use std::str::FromStr;

use dmp_log::LogSummary;

/// The instant of a scan at which a pose with the scan's stamp holds. As text (`FromStr`, `Display`):
/// `stamp`, `start`, `middle`, `end`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PoseAt {
    /// At its stamp.
    #[default]
    Stamp,
    /// At the first return of the scan.
    Start,
    /// Halfway between the first and the last return.
    Middle,
    /// At the last return.
    End,
}

impl PoseAt {
    /// Every instant.
    pub const ALL: [Self; 4] = [Self::Stamp, Self::Start, Self::Middle, Self::End];

    /// The time from the stamp of a scan of this log to the instant, nanoseconds.
    pub fn after_stamp_ns(self, log: &LogSummary) -> i64 {
        let [first_ns, last_ns] = log.sweep_ns;
        match self {
            Self::Stamp => 0,
            Self::Start => first_ns,
            Self::Middle => log.middle_ns,
            Self::End => last_ns,
        }
    }
}

impl fmt::Display for PoseAt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Stamp => "stamp",
            Self::Start => "start",
            Self::Middle => "middle",
            Self::End => "end",
        })
    }
}

impl FromStr for PoseAt {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|at| at.to_string() == text);
        found.ok_or_else(|| {
            format!("`{text}` is not an instant of a scan: choose start, middle, end or stamp")
        })
    }
}
