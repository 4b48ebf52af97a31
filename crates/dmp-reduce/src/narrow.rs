//! Sums of returns in 64 bits, as far as these reach: a return is a few vector additions.

use crate::residuals::{LANES, Squares, lane};
use crate::run::RunSums;
use crate::scales::{CV, Scales, TRUNCATED_BITS};
use crate::units::Total;

/// As many numbers below 2^50 have a sum of 64 bits.
const MOST: u64 = 1 << (63 - TRUNCATED_BITS);

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
        self.lanes[lane::RETURNS] == 0 && self.wide.returns() == 0
    }

    /// The sums.
    pub fn sums(&self) -> RunSums {
        let mut sums = self.wide;
        sums.add_lanes(&self.lanes);
        sums
    }
}

/// Numbers of a pair: the return, the squares of the first run, those of the second; the last is 0.
const PAIR_LANES: usize = 2 + 2 * CV;

/// The sums of a pair over its common returns in one group of surface.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct NarrowPair {
    lanes: [u64; PAIR_LANES],
    returns: u64,
    a: [i128; CV],
    b: [i128; CV],
}

impl NarrowPair {
    #[inline]
    pub(crate) fn add(&mut self, a: &[u64; CV], b: &[u64; CV]) {
        self.lanes[0] += 1;
        for k in 0..CV {
            self.lanes[1 + k] += a[k];
            self.lanes[1 + CV + k] += b[k];
        }
        if self.lanes[0] == MOST {
            *self = self.whole();
        }
    }

    /// With all in the wide sums.
    fn whole(&self) -> Self {
        let mut whole = *self;
        whole.returns += self.lanes[0];
        for k in 0..CV {
            whole.a[k] += i128::from(self.lanes[1 + k]);
            whole.b[k] += i128::from(self.lanes[1 + CV + k]);
        }
        whole.lanes = [0; PAIR_LANES];
        whole
    }

    pub(crate) fn merge(&mut self, other: &Self) {
        let other = other.whole();
        self.returns += other.returns;
        for k in 0..CV {
            self.a[k] += other.a[k];
            self.b[k] += other.b[k];
        }
    }

    /// The returns, and the sums of the two runs at each scale.
    pub(crate) fn sums(&self) -> (u64, [i128; CV], [i128; CV]) {
        let Self { returns, a, b, .. } = self.whole();
        (returns, a, b)
    }

    /// The difference a − b at the `scale`-th scale.
    pub(crate) fn difference(&self, scale: usize) -> Total {
        let (returns, a, b) = self.sums();
        Total { sum: a[scale] - b[scale], returns }
    }
}
