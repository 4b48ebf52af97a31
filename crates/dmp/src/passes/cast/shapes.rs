//! The summary of each scan from which odd scans are detected.

use dmp_sensor::{DropReason, ReturnCounts, Scan};
use serde::{Deserialize, Serialize};

/// Shares of ranges are counted in half octaves from 0.25 m.
const BINS: usize = 24;
const FIRST_EXPONENT: i32 = -2;
/// Number of half octaves from 1 m on for a scan's farthest returns.
const FAR_BINS: usize = 34;
/// The number of farthest returns ignored, and the fraction 1/n: sunlight causes some.
const STRAY: u64 = 16;
const ONE_STRAY_OF: u64 = 256;

/// The summary of a scan for comparison with others: counts and the distribution of ranges.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct ScanShape {
    /// Points with an echo.
    pub(super) returns: u32,
    /// Returns that are used.
    pub(super) used: u32,
    pub(super) implausible: u32,
    /// The half octave from 1 m in which its ranges end, except for a few; unused returns count.
    pub(super) end: u8,
    /// Shares of the used returns, in 1/255.
    shares: [u8; BINS],
}

/// Counts the ranges of a scan.
#[derive(Debug, Clone, Default)]
pub(super) struct ShapeCounts {
    bins: [u32; BINS],
    end: u8,
}

impl ShapeCounts {
    /// Counts all returns of a scan, at any range.
    pub(super) fn look_at(&mut self, scan: &Scan) {
        let mut bins = [0_u64; FAR_BINS];
        for point in &scan.points_in_sensor_m {
            let [x, y, z] = point.map(f64::from);
            let square = x * x + y * y + z * z;
            // The exponent of the square: half octaves without a root. No sensor has ranges beyond the last.
            let half_octave = (square.to_bits() >> 52) as i64 - 1023;
            if let Some(count) = usize::try_from(half_octave).ok().and_then(|bin| bins.get_mut(bin)) {
                *count += 1;
            }
        }
        let stray = STRAY.max(scan.len() as u64 / ONE_STRAY_OF);
        let mut beyond = 0;
        let end = bins.iter().rposition(|count| {
            beyond += count;
            beyond > stray
        });
        self.end = end.unwrap_or(0) as u8;
    }

    /// Counts returns that are used.
    pub(super) fn add(&mut self, points_in_sensor_m: &[[f32; 3]]) {
        for point in points_in_sensor_m {
            let range_m = point.iter().map(|&c| f64::from(c) * f64::from(c)).sum::<f64>().sqrt();
            // Exponent and first bit of the mantissa: half octaves without a logarithm.
            let bits = range_m.to_bits() >> 51;
            let half_octave = bits as i64 - 2 * (1023 + i64::from(FIRST_EXPONENT));
            self.bins[half_octave.clamp(0, BINS as i64 - 1) as usize] += 1;
        }
    }

    /// The counts since the last call.
    pub(super) fn take(&mut self, counts: &ReturnCounts) -> ScanShape {
        let Self { bins, end } = std::mem::take(self);
        let used: u32 = bins.iter().sum();
        let share =
            |count: u32| ((255 * u64::from(count) + u64::from(used) / 2) / u64::from(used.max(1))) as u8;
        let nothing = counts.dropped(DropReason::NonFinite) + counts.dropped(DropReason::NoReturn);
        let [returns, implausible] = [counts.total() - nothing, counts.implausible()]
            .map(|count| count.min(u64::from(u32::MAX)) as u32);
        ScanShape { returns, used, implausible, end, shares: bins.map(share) }
    }
}

impl ScanShape {
    /// Share of the returns at other ranges: total variation, 0 to 1.
    pub(super) fn apart(&self, other: &Self) -> f64 {
        let differences = self.shares.iter().zip(&other.shares).map(|(a, b)| u32::from(a.abs_diff(*b)));
        f64::from(differences.sum::<u32>()) / 510.0
    }
}

/// Where a half octave from 1 m on begins, metres.
pub(super) fn half_octave_m(number: u8) -> f64 {
    f64::from(1_u32 << (number / 2)) * if number.is_multiple_of(2) { 1.0 } else { std::f64::consts::SQRT_2 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_octaves_are_distinguished() {
        let shape_of = |range_m: f64| {
            let mut counts = ShapeCounts::default();
            counts.add(&[[0.0, range_m as f32, 0.0]]);
            counts.take(&ReturnCounts::default())
        };
        let bin = |range_m: f64| shape_of(range_m).shares.iter().position(|&share| share == 255);
        assert_eq!(
            [0.001, 0.25, 0.37, 0.38, 0.5, 0.75, 1.0, 1e9].map(bin),
            [0, 0, 0, 1, 2, 3, 4, BINS - 1].map(Some)
        );
        let empty = ShapeCounts::default().take(&ReturnCounts::default());
        assert_eq!((empty.used, empty.shares), (0, [0; BINS]));
    }

    #[test]
    fn ranges_end_where_all_but_a_few_do() {
        let end = |far: usize, at_m: f32| {
            let near = vec![[3.0, 0.0, 0.0]; 1000 - far];
            let points_in_sensor_m = [near, vec![[0.0, at_m, 0.0]; far]].concat();
            let scan = Scan { points_in_sensor_m, ..Scan::default() };
            let mut counts = ShapeCounts::default();
            counts.look_at(&scan);
            half_octave_m(counts.take(&ReturnCounts::default()).end)
        };
        assert_eq!([end(0, 0.0), end(17, 64.5), end(16, 64.5)].map(f64::round), [3.0, 64.0, 3.0]);
        // Implausible ranges are counted separately.
        assert_eq!(
            [end(100, 1e9), end(100, f32::NAN), end(100, f32::MAX), end(1000, 1e-9)].map(f64::round),
            [3.0, 3.0, 3.0, 1.0]
        );
    }
}
