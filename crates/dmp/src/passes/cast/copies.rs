//! Detects scans that repeat another scan: a driver that hangs sends its last scan again and again.

use std::fmt;

/// One scan, or several in a row, with the returns of an earlier scan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CopiedScans {
    /// Its number in the log, or that of the first of several.
    pub scan: usize,
    /// Number of the last.
    pub last: usize,
    /// The number of the scan that has the same returns.
    pub original: usize,
}

impl fmt::Display for CopiedScans {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { scan, last, original } = self;
        if scan == last {
            write!(f, "scan {scan} holds the same as scan {original}")
        } else {
            write!(f, "scans {scan} to {last} hold the same as scan {original}")
        }
    }
}

/// The scans, by their numbers, whose mark equals that of an earlier scan in time.
pub(super) fn copied_scans(marks: &[(usize, u64)]) -> Vec<CopiedScans> {
    let mut by_mark: Vec<usize> = (0..marks.len()).collect();
    by_mark.sort_unstable_by_key(|&k| (marks[k].1, k));
    let alike = by_mark.chunk_by(|&a, &b| marks[a].1 == marks[b].1);
    let mut copies: Vec<(usize, usize)> =
        alike.flat_map(|alike| alike.iter().skip(1).map(|&copy| (copy, alike[0]))).collect();
    copies.sort_unstable();
    let mut rows: Vec<CopiedScans> = Vec::new();
    for (copy, original) in copies.into_iter().map(|(copy, original)| (marks[copy].0, marks[original].0)) {
        match rows.last_mut() {
            Some(row) if row.original == original && row.last + 1 == copy => row.last = copy,
            _ => rows.push(CopiedScans { scan: copy, last: copy, original }),
        }
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn copies_in_a_row_are_reported_together() {
        let marks: Vec<(usize, u64)> =
            [1, 2, 2, 2, 3, 1, 2, 4].into_iter().enumerate().map(|(k, mark)| (k + 10, mark)).collect();
        let row = |scan, last, original| CopiedScans { scan, last, original };
        assert_eq!(copied_scans(&marks), [row(12, 13, 11), row(15, 15, 10), row(16, 16, 11)]);
        assert_eq!(copied_scans(&marks[..2]), []);
    }
}
