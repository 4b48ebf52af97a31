//! A file of the folder that can be read.

use std::path::PathBuf;
use std::time::SystemTime;

/// A file that can be read.
#[derive(Debug)]
pub(super) struct Entry {
    pub(super) path: PathBuf,
    pub(super) points: u64,
    /// Its place among the layouts.
    pub(super) layout: usize,
    pub(super) stamp_ns: Option<i64>,
    /// Length and time of the last change: whatever differs later is another file.
    pub(super) length: u64,
    pub(super) modified: Option<SystemTime>,
    /// Fewer points than there should be.
    pub(super) is_cut: bool,
}
