//! Sums of returns in 64 bits, as far as these reach: a return is a few vector additions.

use super::run::RunSums;
use crate::residual::{LANES, Scales, Squares, TRUNCATED_BITS, lane};

/// As many numbers below 2^50 have a sum of 64 bits.
pub(crate) const MOST: u64 = 1 << (63 - TRUNCATED_BITS);

/// [`RunSums`] on their way: to the same bits, in a fraction of the time. Sums of a run over some returns of a scan.
///
/// ```
/// use dmp_reduce::{NarrowSums, Residuals, RunSums, Scales, Squares};
///
/// let (mut narrow, mut sums) = (NarrowSums::new(Scales::Drive), RunSums::new(Scales::Drive));
/// for k in 0..20_000 {
///     let residuals = Residuals::all(0.001 * f64::from(k));
///     narrow.add(&Squares::of(&residuals, Scales::Drive));
///     sums.add(&residuals);
/// }
/// assert_eq!(narrow.sums(), sums);
/// ```
#[derive(Debug, Clone, Copy, Default)]
pub struct NarrowSums {
    lanes: [u64; LANES],
    wide: RunSums,
}

impl NarrowSums {
    /// Empty sums on `scales`.
    pub fn new(scales: Scales) -> Self {
        Self { lanes: [0; LANES], wide: RunSums::new(scales) }
    }

    /// Adds one return, whose squares are on the scales of the sums.
    #[inline]
    pub fn add(&mut self, squares: &Squares) {
        for (sum, number) in self.lanes.iter_mut().zip(squares.lanes) {
            *sum += number;
        }
        if squares.far_first > 0 || squares.depth.is_some() {
            self.wide.add_wide(squares);
        }
        if self.lanes[lane::RETURNS] == MOST {
            self.wide.add_lanes(&self.lanes);
            self.lanes = [0; LANES];
        }
    }

    /// Adds the sums of other returns.
    pub(crate) fn merge(&mut self, other: &Self) {
        self.wide.merge(&other.sums());
    }

    /// Whether no return was added.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.lanes[lane::RETURNS] + self.lanes[lane::LEFT_OUT] == 0 && self.wide.is_empty()
    }

    /// The sums.
    pub fn sums(&self) -> RunSums {
        let mut sums = self.wide;
        sums.add_lanes(&self.lanes);
        sums
    }
}
