//! The sums of one run over any set of returns, and the scores that come of them.

use std::str::FromStr;

use crate::numbers::FixedSum;
use crate::residual::{Basis, CV, LANES, MissPrice, NEAR, Residuals, Scales, Squares, WIDEST, lane};

/// Below this share of returns with an independent crossing `R_cv` is not given.
const COVERAGE_NEEDED: f64 = 0.5;

/// Below this share of returns that are seen on another visit, scores hardly show drift.
pub const REVISIT_NEEDED: f64 = 0.05;

/// The sums of one run over any set of returns: a frame, a tile, the whole log. Order-free: sums of
/// parts merge to the sums of the whole, bit for bit.
///
/// Every score is `None` over nothing. The default is empty, on the scales of a LiDAR.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct RunSums {
    scales: Scales,
    returns: u64,
    with_first: u64,
    with_independent: u64,
    revisited: u64,
    blocked: u64,
    non_finite: u64,
    left_out: u64,
    dmp: FixedSum,
    /// Of a depth camera: of its own number, and in parts of its noise.
    depth: [FixedSum; 2],
    cv: [FixedSum; CV],
    near: [FixedSum; NEAR],
}

/// Why a run's `R_cv` is not given.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Withheld {
    /// There is nothing to score.
    #[error("no returns")]
    NoReturns,
    /// The map was given, so nothing is known of which surfels are independent of a return.
    #[error("the map was given, so no crossing is known to be independent of the return")]
    MapGiven,
    /// Too few returns have an independent crossing; the score would mostly be the price of the others.
    #[error("coverage is {coverage:.3}, below 0.5")]
    LowCoverage {
        /// Share of returns with an independent crossing.
        coverage: f64,
    },
}

/// Reads back the sentence that is written; a coverage has three decimals then.
impl FromStr for Withheld {
    type Err = ();

    fn from_str(sentence: &str) -> Result<Self, ()> {
        let coverage = sentence.split([' ', ',']).nth(2).and_then(|share| share.parse().ok());
        let low = coverage.map(|coverage| Self::LowCoverage { coverage });
        let all = [Self::NoReturns, Self::MapGiven].into_iter().chain(low);
        all.into_iter().find(|why| why.to_string() == sentence).ok_or(())
    }
}

impl RunSums {
    /// Empty sums on `scales`.
    pub fn new(scales: Scales) -> Self {
        Self { scales, ..Self::default() }
    }

    /// Adds one return.
    #[inline]
    pub fn add(&mut self, residuals: &Residuals) {
        self.add_squares(&Squares::of(residuals, self.scales));
    }

    #[inline]
    fn add_squares(&mut self, squares: &Squares) {
        self.add_lanes(&squares.lanes);
        self.add_wide(squares);
    }

    /// Adds what the numbers of some returns came to.
    pub(crate) fn add_lanes(&mut self, lanes: &[u64; LANES]) {
        self.returns += lanes[lane::RETURNS];
        self.with_first += lanes[lane::WITH_FIRST];
        self.with_independent += lanes[lane::WITH_INDEPENDENT];
        self.revisited += lanes[lane::REVISITED];
        self.blocked += lanes[lane::BLOCKED];
        self.non_finite += lanes[lane::NON_FINITE];
        self.left_out += lanes[lane::LEFT_OUT];
        self.dmp += FixedSum::from_units(lanes[lane::FIRST].into());
        for (sum, &square) in self.cv.iter_mut().zip(&lanes[lane::CV_SQUARES]) {
            *sum += FixedSum::from_units(square.into());
        }
        for (sum, &square) in self.near.iter_mut().zip(&lanes[lane::NEAR_SQUARES]) {
            *sum += FixedSum::from_units(square.into());
        }
    }

    /// Adds those squares of a return that are too wide for its numbers.
    #[inline]
    pub(crate) fn add_wide(&mut self, squares: &Squares) {
        if squares.far_first > 0 {
            self.dmp += FixedSum::from_units(squares.far_first as i128);
        }
        if let Some(depth) = squares.depth {
            for (sum, square) in self.depth.iter_mut().zip(depth) {
                *sum += FixedSum::from_units(square as i128);
            }
        }
    }

    /// Adds the sums of other returns. Sums of nothing take the scales of the others.
    ///
    /// # Panics
    /// Where both are of some returns and on different scales.
    pub fn merge(&mut self, other: &Self) {
        if self.is_empty() && !other.is_empty() {
            self.scales = other.scales;
        }
        assert!(other.is_empty() || other.scales == self.scales, "sums on different scales");
        self.returns += other.returns;
        self.with_first += other.with_first;
        self.with_independent += other.with_independent;
        self.revisited += other.revisited;
        self.blocked += other.blocked;
        self.non_finite += other.non_finite;
        self.left_out += other.left_out;
        self.dmp += other.dmp;
        for (mine, theirs) in self.depth.iter_mut().zip(other.depth) {
            *mine += theirs;
        }
        for (mine, theirs) in self.cv.iter_mut().zip(other.cv) {
            *mine += theirs;
        }
        for (mine, theirs) in self.near.iter_mut().zip(other.near) {
            *mine += theirs;
        }
    }

    /// Returns scored, misses included.
    pub fn returns(&self) -> u64 {
        self.returns
    }

    /// Returns whose ray crosses a surfel.
    pub fn with_first(&self) -> u64 {
        self.with_first
    }

    /// Returns whose ray crosses an independent surfel.
    pub fn with_independent(&self) -> u64 {
        self.with_independent
    }

    /// Residuals that were NaN or infinite and were taken as misses. More than 0 is a fault upstream.
    pub fn non_finite(&self) -> u64 {
        self.non_finite
    }

    /// Returns that are not scored since the map left out their places: see [`Residuals::is_left_out`].
    pub fn left_out(&self) -> u64 {
        self.left_out
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.returns + self.left_out == 0
    }

    /// DMP (Zhang & Chen 2021, eq. 13): Σ (z − z1)² over the returns with z1, square metres. 0 over nothing.
    pub fn dmp_sum_m2(&self) -> f64 {
        self.dmp.to_m2()
    }

    /// The mean of DMP over the returns with z1.
    pub fn dmp_mean_m2(&self) -> Option<f64> {
        self.dmp.mean_m2(self.with_first)
    }

    /// DMP of a depth camera in its own number (Zhang & Chen 2021, eq. 13, where z is depth): Σ (z − z1)² along the
    /// optical axis, square metres. 0 for a LiDAR.
    pub fn dmp_depth_sum_m2(&self) -> f64 {
        self.depth[0].to_m2()
    }

    /// The mean of that over the returns with z1.
    pub fn dmp_depth_mean_m2(&self) -> Option<f64> {
        self.depth[0].mean_m2(self.with_first)
    }

    /// Σ ((z − z1) / σ(z))² of a depth camera, whose noise σ grows with depth: twice what its raw log-likelihood is
    /// below the constant (eq. 8–12). 0 for a LiDAR.
    pub fn depth_sigmas_squared(&self) -> f64 {
        self.depth[1].to_m2()
    }

    /// Whether returns were judged by other lengths than these; sums of nothing were not.
    pub(crate) fn are_on_other_than(&self, scales: Scales) -> bool {
        !self.is_empty() && self.scales != scales
    }

    /// The lengths by which the returns were judged.
    pub fn scales(&self) -> Scales {
        self.scales
    }

    /// `R_cv` at its widest scale τ, 10 m for a LiDAR: the mean over *all* returns of min((z − zc)², τ²), or the price
    /// where there is no zc. Given whatever the coverage, see [`Self::r_cv_withheld`].
    pub fn r_cv_widest_m2(&self, price: MissPrice) -> Option<f64> {
        let (sum, count) = self.cv_ratio(WIDEST, price);
        sum.mean_m2(count)
    }

    /// `R_cv` as (scale in metres, score), at 10, 2, 0.5 and 0.2 m for a LiDAR: the first is [`Self::r_cv_widest_m2`],
    /// the others are the mean of min((z − zc)², τ²) over the returns with zc.
    pub fn r_cv_m2(&self, price: MissPrice) -> [(f64, Option<f64>); CV - WIDEST] {
        std::array::from_fn(|k| {
            let (sum, count) = self.cv_ratio(WIDEST + k, price);
            (self.scales.lengths().cv_m[WIDEST + k], sum.mean_m2(count))
        })
    }

    /// `R_near` as (scale in metres, score), at 5, 2 and 0.5 m for a LiDAR: the mean of min((z − zn)², τ²) over the
    /// returns with z1.
    pub fn r_near_m2(&self) -> [(f64, Option<f64>); NEAR] {
        std::array::from_fn(|k| (self.scales.lengths().near_m[k], self.near[k].mean_m2(self.with_first)))
    }

    /// Why `R_cv` is not to be given for this run; `None` where it is.
    pub fn r_cv_withheld(&self, basis: Basis) -> Option<Withheld> {
        match self.coverage() {
            None => Some(Withheld::NoReturns),
            Some(_) if basis == Basis::Near => Some(Withheld::MapGiven),
            Some(coverage) if coverage < COVERAGE_NEEDED => Some(Withheld::LowCoverage { coverage }),
            Some(_) => None,
        }
    }

    /// Share of returns that cross no surfel.
    pub fn miss_rate(&self) -> Option<f64> {
        self.share(self.returns - self.with_first)
    }

    /// Share of returns that cross a surfel more than [`Lengths::blocked_m`](crate::Lengths) before the measured range.
    pub fn blocked_rate(&self) -> Option<f64> {
        self.share(self.blocked)
    }

    /// Share of returns that cross an independent surfel.
    pub fn coverage(&self) -> Option<f64> {
        self.share(self.with_independent)
    }

    /// Share of returns that still do when five segments to either side are left out: how much of the
    /// log is seen again. Below [`REVISIT_NEEDED`] nothing certain can be said on the global shape.
    pub fn coverage_revisit(&self) -> Option<f64> {
        self.share(self.revisited)
    }

    /// Returns of [`Self::coverage_revisit`].
    pub(crate) fn revisited(&self) -> u64 {
        self.revisited
    }

    fn share(&self, count: u64) -> Option<f64> {
        (self.returns > 0).then(|| count as f64 / self.returns as f64)
    }

    /// Numerator and denominator of `R_cv` at the `scale`-th of [`Lengths::cv_m`](crate::Lengths).
    pub(crate) fn cv_ratio(&self, scale: usize, price: MissPrice) -> (FixedSum, u64) {
        if scale != WIDEST {
            return (self.cv[scale], self.with_independent);
        }
        let missing = i128::from(self.returns - self.with_independent);
        (self.cv[scale] + FixedSum::from_units(missing * price.units(self.scales)), self.returns)
    }

    /// Numerator and denominator of `R_near` at the `scale`-th of [`Lengths::near_m`](crate::Lengths).
    pub(crate) fn near_ratio(&self, scale: usize) -> (FixedSum, u64) {
        (self.near[scale], self.with_first)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn independent(residual_m: f64) -> Residuals {
        Residuals { independent_m: Some(residual_m), ..Residuals::MISS }
    }

    #[test]
    fn nothing_has_no_score() {
        let sums = RunSums::default();
        let price = MissPrice::default();
        assert_eq!((sums.dmp_sum_m2(), sums.dmp_mean_m2(), sums.r_cv_widest_m2(price)), (0.0, None, None));
        assert_eq!((sums.miss_rate(), sums.blocked_rate(), sums.coverage()), (None, None, None));
        assert!(sums.r_near_m2().iter().chain(&sums.r_cv_m2(price)).all(|(_, score)| score.is_none()));
        assert_eq!(sums.r_cv_withheld(Basis::CrossValidated), Some(Withheld::NoReturns));
    }

    #[test]
    fn r_cv_is_withheld_with_its_reason() {
        let mut sums = RunSums::default();
        sums.add(&independent(0.0));
        sums.add(&Residuals::MISS);
        assert_eq!(sums.r_cv_withheld(Basis::CrossValidated), None);
        assert_eq!(sums.r_cv_withheld(Basis::Near), Some(Withheld::MapGiven));
        sums.add(&Residuals::MISS);
        let why = sums.r_cv_withheld(Basis::CrossValidated).unwrap();
        assert_eq!(why.to_string(), "coverage is 0.333, below 0.5");
        assert_eq!(why.to_string().parse(), Ok(Withheld::LowCoverage { coverage: 0.333 }));
        assert!(sums.r_cv_widest_m2(MissPrice::default()).is_some());
    }
}
