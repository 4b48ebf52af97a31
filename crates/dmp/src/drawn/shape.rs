//! The summary of each scan from which odd scans are detected.

use dmp_sensor::{Scan, is_implausible};
use serde::{Deserialize, Serialize};

/// Shares of ranges are counted in half octaves from 0.25 m.
const BINS: usize = 24;
const FIRST_EXPONENT: i64 = -2;
/// Number of half octaves from 1 m on for a scan's farthest returns.
const FAR_BINS: usize = 34;
/// The number of farthest returns ignored, and the fraction 1/n: sunlight causes some.
const STRAY: u64 = 16;
const ONE_STRAY_OF: u64 = 256;

/// The summary of a scan for comparison with others: counts and the distribution of ranges, of all returns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct ScanShape {
    /// Points with an echo.
    pub(crate) returns: u32,
    pub(crate) implausible: u32,
    /// The half octave from 1 m in which its ranges end, except for a few.
    pub(crate) end: u8,
    /// Shares of the returns, in 1/255.
    shares: [u8; BINS],
}

impl ScanShape {
    pub(crate) fn of(scan: &Scan) -> Self {
        let (mut bins, mut far_bins) = ([0_u64; BINS], [0_u64; FAR_BINS]);
        let (mut returns, mut implausible) = (0_u64, 0_u64);
        for &point in &scan.points_in_sensor_m {
            let square = point.iter().map(|&c| f64::from(c) * f64::from(c)).sum::<f64>();
            if !(square > 0.0 && square.is_finite()) {
                continue;
            }
            returns += 1;
            implausible += u64::from(is_implausible(point));
            // The exponent of the square: half octaves of the range without a root.
            let half_octave = (square.to_bits() >> 52) as i64 - 1023;
            let bin = (half_octave - 2 * FIRST_EXPONENT).clamp(0, BINS as i64 - 1);
            bins[bin as usize] += 1;
            // No sensor has ranges beyond the last.
            if let Some(count) = usize::try_from(half_octave).ok().and_then(|bin| far_bins.get_mut(bin)) {
                *count += 1;
            }
        }
        let stray = STRAY.max(returns / ONE_STRAY_OF);
        let mut beyond = 0;
        let end = far_bins.iter().rposition(|count| {
            beyond += count;
            beyond > stray
        });
        let share = |count: u64| ((255 * count + returns / 2) / returns.max(1)) as u8;
        let count = |count: u64| count.min(u64::from(u32::MAX)) as u32;
        Self {
            returns: count(returns),
            implausible: count(implausible),
            end: end.unwrap_or(0) as u8,
            shares: bins.map(share),
        }
    }

    /// Share of the returns at other ranges: total variation, 0 to 1.
    pub(crate) fn apart(&self, other: &Self) -> f64 {
        let differences = self.shares.iter().zip(&other.shares).map(|(a, b)| u32::from(a.abs_diff(*b)));
        f64::from(differences.sum::<u32>()) / 510.0
    }
}

/// Where a half octave from 1 m on begins, metres.
pub(crate) fn half_octave_m(number: u8) -> f64 {
    f64::from(1_u32 << (number / 2)) * if number.is_multiple_of(2) { 1.0 } else { std::f64::consts::SQRT_2 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shape_of(ranges_m: &[f32]) -> ScanShape {
        let points_in_sensor_m = ranges_m.iter().map(|&range_m| [0.0, range_m, 0.0]).collect();
        ScanShape::of(&Scan { points_in_sensor_m, ..Scan::default() })
    }

    #[test]
    fn half_octaves_are_distinguished() {
        let bin = |range_m| shape_of(&[range_m]).shares.iter().position(|&share| share == 255);
        assert_eq!(
            [0.001, 0.25, 0.35, 0.36, 0.5, 0.71, 1.0, 1e9].map(bin),
            [0, 0, 0, 1, 2, 3, 4, BINS - 1].map(Some)
        );
        let empty = shape_of(&[0.0, f32::NAN]);
        assert_eq!((empty.returns, empty.shares), (0, [0; BINS]));
    }

    #[test]
    fn ranges_end_where_all_but_a_few_do() {
        let end = |far: usize, at_m: f32| {
            half_octave_m(shape_of(&[vec![3.0; 1000 - far], vec![at_m; far]].concat()).end)
        };
        assert_eq!([end(0, 0.0), end(17, 64.5), end(16, 64.5)].map(f64::round), [3.0, 64.0, 3.0]);
        // Implausible ranges are counted separately.
        assert_eq!(
            [end(100, 1e9), end(100, f32::NAN), end(100, f32::MAX), end(1000, 1e-9)].map(f64::round),
            [3.0, 3.0, 3.0, 1.0]
        );
        assert_eq!([shape_of(&[1e9, 1e-4, 3.0]).implausible, shape_of(&[f32::NAN, 0.0]).implausible], [2, 0]);
    }
}
