//! The head of a file with one scan.

use crate::logs::scan_folder::scan_file::packed::Packed;
use crate::logs::scan_folder::scan_file::text::TextRows;
use crate::points::Layout;

/// What a head says.
#[derive(Debug)]
pub(crate) struct Head {
    /// That of the rows which [`ScanFile::read_rows`](crate::logs::scan_folder::scan_file::file::ScanFile::read_rows) gives.
    pub(crate) layout: Layout,
    /// Points claimed.
    pub(crate) points: u64,
    pub(crate) body: Body,
}

#[derive(Debug)]
pub(crate) enum Body {
    /// The rows themselves, from this byte on.
    Rows { data_at: u64 },
    /// A line for each, after so many lines of others.
    Text { data_at: u64, lines_before: u64, skipped: u64, rows: TextRows },
    /// Field by field, compressed.
    Packed(Packed),
    /// In the records of LAS.
    Las { compressed: bool },
}
