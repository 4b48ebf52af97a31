//! At which instant of its scan a pose holds.

use std::fmt;
use std::str::FromStr;

use dmp_log::LogSummary;

/// At which instant of its scan a pose holds whose stamp is that of the scan. As text (`FromStr`, `Display`): `stamp`,
/// `start`, `middle`, `end`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PoseAt {
    /// At its stamp.
    #[default]
    Stamp,
    /// When the first return of the scan was measured.
    Start,
    /// Halfway between the first and the last.
    Middle,
    /// When the last was.
    End,
}

impl PoseAt {
    /// Every instant.
    pub const ALL: [Self; 4] = [Self::Stamp, Self::Start, Self::Middle, Self::End];

    /// How long after the stamp of a scan of this log that is, nanoseconds.
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
        found.ok_or_else(|| format!("`{text}` is no instant of a scan: it is start, middle, end or stamp"))
    }
}
