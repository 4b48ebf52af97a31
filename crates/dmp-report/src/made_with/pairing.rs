//! The rule that matches scans with poses.

/// The rule that finds a run's poses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Pairing {
    /// By the time of each return.
    #[serde(rename = "by stamp")]
    ByStamp,
    /// The n-th pose belongs to the n-th scan; times of returns count from the pose's stamp, if it has one.
    #[serde(rename = "line by line")]
    ByLine,
}
