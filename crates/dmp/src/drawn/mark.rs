//! A mark of each scan by which its copies are found.

use dmp_sensor::Scan;

/// With fewer returns two scans may be equal by chance.
const ENOUGH: usize = 16;

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
}
