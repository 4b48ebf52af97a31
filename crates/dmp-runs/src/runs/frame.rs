//! A scan that is asked for.

/// A scan to be scored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PlannedFrame {
    /// Its index in the log that is read.
    pub frame: usize,
    /// Its number in the whole log, if only a part is read.
    pub number: usize,
    /// Its stamp with the time offset, nanoseconds; `None` if the log has none.
    pub stamp_ns: Option<i64>,
    /// Returns in it, used or not.
    pub returns: u64,
}
