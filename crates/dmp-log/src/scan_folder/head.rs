//! The head of a file with one scan.

use super::packed::Packed;
use super::text::TextRows;
use crate::points::Layout;

/// What a head says.
#[derive(Debug)]
pub(super) struct Head {
    /// That of the rows which [`ScanFile::read_rows`](super::file::ScanFile::read_rows) gives.
    pub(super) layout: Layout,
    /// Points claimed.
    pub(super) points: u64,
    pub(super) body: Body,
}

#[derive(Debug)]
pub(super) enum Body {
    /// The rows themselves, from this byte on.
    Rows { data_at: u64 },
    /// A line for each, after so many lines of others.
    Text { data_at: u64, lines_before: u64, skipped: u64, rows: TextRows },
    /// Field by field, compressed.
    Packed(Packed),
    /// In the records of LAS.
    Las { compressed: bool },
}
