//! A scan of a folder.

use crate::file::KnownFile;

/// A file that can be read.
#[derive(Debug)]
pub(super) struct Entry {
    pub(super) file: KnownFile,
    pub(super) points: u64,
    /// Its place among the layouts.
    pub(super) layout: usize,
    pub(super) stamp_ns: Option<i64>,
    /// Fewer points than there should be.
    pub(super) is_cut: bool,
}
