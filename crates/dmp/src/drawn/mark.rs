//! A mark of each scan by which its copies are found.

use dmp_reduce::mixed;
use dmp_sensor::Scan;

/// With fewer returns two scans may be equal by chance.
const ENOUGH: usize = 16;

/// Any odd number whose bits look random.
const ODD: u64 = 0x9e37_79b9_7f4a_7c15;

/// A hash of the scan's returns, equal for scans with equal returns; `None` with too few returns.
pub(super) fn mark_of(scan: &Scan) -> Option<u64> {
    let is_return = |point: &&[f32; 3]| point.iter().all(|c| c.is_finite()) && **point != [0.0; 3];
    let returns = scan.points_in_sensor_m.iter().filter(is_return).take(ENOUGH).count();
    // Every return's part depends on its place alone: the sum is computed without waiting for the one before.
    let part = |(place, point): (usize, &[f32; 3])| {
        let [x, y, z] = point.map(|c| u64::from(c.to_bits()));
        mixed((x << 32 | y).wrapping_add((z << 32 ^ place as u64).wrapping_mul(ODD)))
    };
    let mark = || scan.points_in_sensor_m.iter().enumerate().map(part).fold(0, u64::wrapping_add);
    (returns == ENOUGH).then(mark)
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
