//! Whether the scans show a number, or only like what it does to the poses.
//!
//! Between two poses with noise their mean is used, and the mean of two is better than either. So any shift in time may make
//! surfaces thinner, to one side as to the other. An error that is really there makes them thinner to its own side alone.

use dmp_reduce::Confidence;

use crate::calibrate::axis::Vector;
use crate::calibrate::fit::of_blocks_at_finest;
use crate::calibrate::mount::Mount;
use crate::calibrate::planes::Equations;
use crate::calibrate::sample::Block;

/// The mean of two noisy poses has half of their variance: no shift in time leaves less of the mean square by noise alone.
const MOST_BY_MEANS: f64 = 0.5;
/// Fewer blocks give no interval.
const FEWEST_BLOCKS: usize = 3;

/// A statistic of the sums over blocks, and half of its interval: the jackknife.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// The statistic.
    pub value: f64,
    /// Half of its interval.
    pub half: f64,
}

impl Interval {
    /// Of blocks whose errors have nothing to do with each other; `None` where they are too few, or it is no number.
    pub(crate) fn of<T>(
        blocks: &[T],
        confidence: Confidence,
        statistic: impl Fn(&mut dyn Iterator<Item = &T>) -> f64,
    ) -> Option<Self> {
        let count = blocks.len();
        if count < FEWEST_BLOCKS {
            return None;
        }
        let value = statistic(&mut blocks.iter());
        let without = |left: usize| {
            statistic(&mut blocks.iter().enumerate().filter(|(k, _)| *k != left).map(|(_, block)| block))
        };
        let moved: Vec<f64> = (0..count).map(without).collect();
        let mean = moved.iter().sum::<f64>() / count as f64;
        let squares: f64 = moved.iter().map(|one| (one - mean) * (one - mean)).sum();
        let error = (squares * (count - 1) as f64 / count as f64).sqrt();
        let half = confidence.student_t(count as u64 - 1) * error;
        (value.is_finite() && half.is_finite()).then_some(Self { value, half })
    }

    /// Its lower end.
    pub fn low(&self) -> f64 {
        self.value - self.half
    }

    /// Its upper end.
    pub fn high(&self) -> f64 {
        self.value + self.half
    }
}

/// Whether surfaces are thinner with `fixed` than with `given`, and not as much thinner with `opposite`, beyond doubt: of
/// what is gained with the one, less than half is gained with the other. Twice an error that is so large that surfaces
/// fall apart makes them no thicker than once; but what more than halves the square is no mean of poses.
pub(crate) fn is_shown(
    blocks: &[Block],
    mount: &Mount<'_>,
    metre_m: f64,
    [given, fixed, opposite]: [&Vector; 3],
    confidence: Confidence,
) -> bool {
    let at = |steps: &Vector| of_blocks_at_finest(blocks, mount, metre_m, steps);
    let (given, fixed, opposite) = (at(given), at(fixed), at(opposite));
    let all: Vec<[&Equations; 3]> =
        given.iter().zip(&fixed).zip(&opposite).map(|((a, b), c)| [a, b, c]).collect();
    let seen: Vec<_> = all.into_iter().filter(|three| three.iter().all(|one| one.weight > 0.0)).collect();
    let thickness_m2 = |three: &[[f64; 2]; 3], of: usize| three[of][0] / three[of][1];
    let sums_of = |blocks: &mut dyn Iterator<Item = &[&Equations; 3]>| {
        let mut sums = [[0.0; 2]; 3];
        for block in blocks {
            for (sum, one) in sums.iter_mut().zip(block) {
                sum[0] += one.squares_m2;
                sum[1] += one.weight;
            }
        }
        sums
    };
    let more_than_half = |blocks: &mut dyn Iterator<Item = &[&Equations; 3]>| {
        let sums = sums_of(blocks);
        thickness_m2(&sums, 2) - 0.5 * (thickness_m2(&sums, 0) + thickness_m2(&sums, 1))
    };
    let sums = sums_of(&mut seen.iter());
    if thickness_m2(&sums, 1) < MOST_BY_MEANS * thickness_m2(&sums, 0) {
        return true;
    }
    Interval::of(&seen, confidence, more_than_half).is_some_and(|one| one.low() > 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interval_of_a_mean_is_students() {
        let values = [1.0, 2.0, 4.0, 7.0, 11.0];
        let mean = |some: &mut dyn Iterator<Item = &f64>| {
            let some: Vec<f64> = some.copied().collect();
            some.iter().sum::<f64>() / some.len() as f64
        };
        let one = Interval::of(&values, Confidence::P99, mean).unwrap();
        // A standard deviation of 4.0620, over the root of five, times 4.6041 of four degrees of freedom.
        assert!((one.value - 5.0).abs() < 1e-12 && (one.half - 8.3637).abs() < 2e-3, "{one:?}");
        assert_eq!(Interval::of(&values[..2], Confidence::P99, mean), None);
    }
}
