//! The length of a segment of the drive.

/// The length of a segment of the drive.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SegmentLength {
    /// By the distance travelled, metres.
    Metres(f64),
    /// By the stamps of the scans, seconds.
    Seconds(f64),
    /// By the number of scans in use.
    Scans(u64),
}
