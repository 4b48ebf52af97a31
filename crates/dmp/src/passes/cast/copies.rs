//! Detects scans that repeat another scan: a driver that hangs sends its last scan again and again.

use std::fmt;

use dmp_sensor::Scan;

/// With fewer returns two scans may be equal by chance.
const ENOUGH: usize = 16;

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

/// A hash of the scan's returns, equal for scans with equal returns; `None` with too few returns.
pub(super) fn mark_of(scan: &Scan) -> Option<u64> {
    let mut mark = 0_u64;
    let mut mix = |word: u64| mark = (mark.rotate_left(5) ^ word).wrapping_mul(0x517c_c1b7_2722_0a95);
    let mut returns = 0;
    for point in &scan.points_in_sensor_m {
        let [x, y, z] = point.map(|c| u64::from(c.to_bits()));
        mix(x << 32 | y);
        mix(z);
        returns += usize::from(point.iter().all(|c| c.is_finite()) && *point != [0.0; 3]);
    }
    (returns >= ENOUGH).then_some(mark)
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

    fn scan(first: f32, returns: usize) -> Scan {
        let points_in_sensor_m = (0..returns).map(|k| [first + k as f32, 1.0, -2.0]).collect();
        Scan { points_in_sensor_m, ..Scan::default() }
    }

    #[test]
    fn a_mark_is_that_of_the_same_returns_only() {
        assert_eq!(mark_of(&scan(1.0, 100)), mark_of(&scan(1.0, 100)));
        for other in [scan(1.5, 100), scan(1.0, 101), scan(2.0, 100)] {
            assert_ne!(mark_of(&other), mark_of(&scan(1.0, 100)));
        }
        let swapped = Scan {
            points_in_sensor_m: scan(1.0, 100).points_in_sensor_m.into_iter().rev().collect(),
            ..Scan::default()
        };
        assert_ne!(mark_of(&swapped), mark_of(&scan(1.0, 100)));
        let nothing = Scan { points_in_sensor_m: vec![[0.0; 3]; 100], ..Scan::default() };
        let holes = Scan { points_in_sensor_m: vec![[f32::NAN; 3]; 100], ..Scan::default() };
        assert_eq!([scan(1.0, 0), scan(1.0, 15), nothing, holes].map(|scan| mark_of(&scan)), [None; 4]);
    }

    #[test]
    fn copies_in_a_row_are_reported_together() {
        let marks: Vec<(usize, u64)> =
            [1, 2, 2, 2, 3, 1, 2, 4].into_iter().enumerate().map(|(k, mark)| (k + 10, mark)).collect();
        let row = |scan, last, original| CopiedScans { scan, last, original };
        assert_eq!(copied_scans(&marks), [row(12, 13, 11), row(15, 15, 10), row(16, 16, 11)]);
        assert_eq!(copied_scans(&marks[..2]), []);
    }
}
