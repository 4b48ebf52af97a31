//! The lengths by which residuals are judged, and their squares in units.

pub use dmp_lengths::{Lengths, Reach, Scales};

use crate::numbers::units_of;

/// As many truncations of `R_cv` as there are, and of `R_near`.
pub(crate) const CV: usize = Lengths::CV;
pub(crate) const NEAR: usize = Lengths::NEAR;
/// Where among those of `R_cv` the scale of the score stands in which a miss has its price.
pub(crate) const WIDEST: usize = Lengths::WIDEST;

/// No truncated square is larger than this many bits, nor is the difference of two.
pub(crate) const TRUNCATED_BITS: u32 = 50;

/// The squares of truncations, in units of 2^-40 m².
#[derive(Debug)]
pub(crate) struct Limits {
    /// τ² of `R_cv`: integers, as `f64`.
    pub(crate) cv: [f64; CV],
    /// τ² of `R_near`.
    pub(crate) near: [f64; NEAR],
}

impl Limits {
    const fn new(lengths: &Lengths) -> Self {
        Self { cv: squares(lengths.cv_m), near: squares(lengths.near_m) }
    }
}

const fn squares<const N: usize>(truncations_m: [f64; N]) -> [f64; N] {
    let (mut squares, mut k) = ([0.0; N], 0);
    while k < N {
        let units = units_of(truncations_m[k] * truncations_m[k]);
        assert!(units < 1 << TRUNCATED_BITS);
        squares[k] = units as f64;
        k += 1;
    }
    squares
}

/// Of every kind, in the order of the kinds.
static LIMITS: [Limits; Scales::ALL.len()] = {
    let mut limits = [const { Limits::new(&Scales::ALL[0].1) }; Scales::ALL.len()];
    let mut k = 0;
    while k < limits.len() {
        limits[k] = Limits::new(&Scales::ALL[k].1);
        k += 1;
    }
    limits
};

#[inline]
pub(crate) fn limits(scales: Scales) -> &'static Limits {
    &LIMITS[scales as usize]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn squares_are_in_units() {
        let units = |m2: u64| (m2 << 38) as f64;
        assert_eq!(limits(Scales::Drive).near, [100, 16, 1].map(units));
        assert_eq!(limits(Scales::Room).cv[WIDEST], units(4));
    }
}
