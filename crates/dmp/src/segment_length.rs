//! How long a segment of the drive is.

/// How long a segment of the drive is.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum SegmentLength {
    /// By the way of the sensor, metres.
    Metres(f64),
    /// By the stamps of the scans, seconds.
    Seconds(f64),
    /// By the number of scans in use.
    Scans(u64),
}
