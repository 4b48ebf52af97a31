//! The residuals of one return squared and truncated, as they are added up.

use super::basis::Basis;
use super::kept::KeptReturn;
use super::residuals::Residuals;
use super::scales::{CV, Scales, TRUNCATED_BITS, limits};
use super::surface::SurfaceGroup;
use crate::numbers::{rounded, short_square_units, square_units, unrounded_units};

/// The residuals of one return squared and truncated, in units: made once, added to many sums.
#[derive(Debug, Clone, Copy, Default)]
pub struct Squares {
    /// What is added up of every return, each below 2^50, in the order of [`lane`].
    pub(crate) lanes: [u64; LANES],
    /// (z − z1)² where that is 2^50 units or more.
    pub(crate) far_first: u128,
    /// (z − z1)² of a depth camera's own number, and in parts of its noise.
    pub(crate) depth: Option<[u128; 2]>,
    surfaces: [SurfaceGroup; 2],
}

/// Numbers of [`Squares::lanes`].
pub(crate) const LANES: usize = 16;

/// Which number of [`Squares::lanes`] is what.
pub(crate) mod lane {
    use crate::residual::scales::{CV, NEAR};
    use std::ops::Range;

    pub(crate) const RETURNS: usize = 0;
    /// Whether there is a z1, and a zc.
    pub(crate) const WITH_FIRST: usize = 1;
    pub(crate) const WITH_INDEPENDENT: usize = 2;
    pub(crate) const REVISITED: usize = 3;
    pub(crate) const BLOCKED: usize = 4;
    pub(crate) const NON_FINITE: usize = 5;
    /// (z − z1)².
    pub(crate) const FIRST: usize = 6;
    /// min((z − zc)², τ²) at the scales of `R_cv`.
    pub(crate) const CV_SQUARES: Range<usize> = 7..7 + CV;
    /// min((z − zn)², τ²) at the scales of `R_near`, where there is a z1.
    pub(crate) const NEAR_SQUARES: Range<usize> = 7 + CV..7 + CV + NEAR;
    /// Whether it is counted here and nowhere else.
    pub(crate) const LEFT_OUT: usize = 7 + CV + NEAR;
}

impl Squares {
    /// Of residuals that are judged by these lengths.
    #[inline]
    pub fn of(residuals: &Residuals, scales: Scales) -> Self {
        if residuals.is_left_out {
            return Self::left_out(residuals);
        }
        let limits = limits(scales);
        let given = [residuals.first_m, residuals.nearest_m, residuals.independent_m];
        let [first, nearest, independent] = given.map(Known::of);
        let known = first.count() + nearest.count() + independent.count();
        let mut lanes = [0; LANES];
        lanes[lane::RETURNS] = 1;
        lanes[lane::WITH_FIRST] = first.count();
        lanes[lane::WITH_INDEPENDENT] = independent.count();
        lanes[lane::REVISITED] = u64::from(residuals.revisited);
        lanes[lane::BLOCKED] = u64::from(first.or_0_m > scales.lengths().blocked_m);
        lanes[lane::NON_FINITE] = given.map(|r| u64::from(r.is_some())).iter().sum::<u64>() - known;
        let square = short_square_units(first.or_0_m);
        let is_short = square < 1 << TRUNCATED_BITS;
        lanes[lane::FIRST] = if is_short { square } else { 0 };
        let far_first = if is_short { 0 } else { square_units(first.or_0_m) };
        // Without a crossing near z the square is the full τ²: no scale is larger than the window
        // in which one was looked for.
        let full = f64::INFINITY.to_bits() & !nearest.mask;
        let near = f64::from_bits((unrounded_units(nearest.or_0_m).to_bits() | full) & first.mask);
        lanes[lane::CV_SQUARES].copy_from_slice(&cut(unrounded_units(independent.or_0_m), limits.cv));
        lanes[lane::NEAR_SQUARES].copy_from_slice(&cut(near, limits.near));
        let depth = residuals.depth.filter(|_| first.count() > 0).map(|depth| {
            [depth.first_m, depth.first_sigmas].map(|off| if off.is_finite() { square_units(off) } else { 0 })
        });
        Self { lanes, far_first, depth, surfaces: residuals.surfaces }
    }

    #[cold]
    fn left_out(residuals: &Residuals) -> Self {
        let mut squares = Self { surfaces: residuals.surfaces, ..Self::default() };
        squares.lanes[lane::LEFT_OUT] = 1;
        squares
    }

    /// These squares in a pair: those of `basis` are of the residual as it is kept.
    #[inline]
    pub(crate) fn as_kept(mut self, residuals: &Residuals, basis: Basis, scales: Scales) -> Self {
        let kept = Self::of(&KeptReturn::of(residuals, basis, scales).residuals(basis, scales), scales);
        let lanes = match basis {
            Basis::CrossValidated => lane::CV_SQUARES,
            Basis::Near => lane::NEAR_SQUARES,
        };
        self.lanes[lanes.clone()].copy_from_slice(&kept.lanes[lanes]);
        self
    }

    /// The piece of surface that a prediction of `basis` lies on.
    #[inline]
    pub(crate) fn surface_on(&self, basis: Basis) -> SurfaceGroup {
        match basis {
            Basis::CrossValidated => self.surfaces[0],
            Basis::Near => self.surfaces[1],
        }
    }

    /// Whether it counts in a pair of `basis`.
    #[inline]
    pub(crate) fn counts_on(&self, basis: Basis) -> bool {
        self.lanes[match basis {
            Basis::CrossValidated => lane::WITH_INDEPENDENT,
            Basis::Near => lane::WITH_FIRST,
        }] > 0
    }

    /// Its truncated squares at the scales of `basis`, zeros where it does not count.
    #[inline]
    pub(crate) fn lanes_on(&self, basis: Basis) -> &[u64] {
        &self.lanes[match basis {
            Basis::CrossValidated => lane::CV_SQUARES,
            Basis::Near => lane::NEAR_SQUARES,
        }]
    }

    /// The truncated squares by which a run counts in a pair of `basis`, at the scales of the basis, zeros behind.
    #[inline]
    pub(crate) fn on(&self, basis: Basis) -> Option<[u64; CV]> {
        self.counts_on(basis).then(|| {
            let (mut on, lanes) = ([0; CV], self.lanes_on(basis));
            on[..lanes.len()].copy_from_slice(lanes);
            on
        })
    }
}

/// A residual that may be missing or no number: whether it is known, and its length, found without jumps, which would be
/// guessed wrong wherever surfaces end.
#[derive(Debug, Clone, Copy)]
struct Known {
    /// All ones, or all zeros.
    mask: u64,
    or_0_m: f64,
}

impl Known {
    #[inline]
    fn of(residual_m: Option<f64>) -> Self {
        const EXPONENT: u64 = f64::INFINITY.to_bits();
        let bits = residual_m.map_or(EXPONENT, f64::to_bits);
        let mask = u64::from(bits & EXPONENT != EXPONENT).wrapping_neg();
        Self { mask, or_0_m: f64::from_bits(bits & mask) }
    }

    /// 1 or 0.
    #[inline]
    fn count(self) -> u64 {
        self.mask & 1
    }
}

/// A square truncated at every limit. Rounding is monotone: the rounded square cut at the rounded τ² is
/// the cut square rounded.
#[inline]
fn cut<const N: usize>(units: f64, limits: [f64; N]) -> [u64; N] {
    limits.map(|limit| rounded(if units < limit { units } else { limit }))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::numbers::units_of;
    use crate::residual::residuals::{DepthResidual, HitKind};

    /// [`Squares::of`] step by step: what is added up of every return, the far square, and those of a camera.
    fn slow(residuals: &Residuals, scales: Scales) -> ([u64; LANES], u128, Option<[u128; 2]>) {
        if residuals.is_left_out {
            return (std::array::from_fn(|k| u64::from(k == 15)), 0, None);
        }
        let lengths = scales.lengths();
        let given = [residuals.first_m, residuals.nearest_m, residuals.independent_m];
        let [first, nearest, independent] = given.map(|r| r.filter(|m| m.is_finite()));
        let cut = |m: Option<f64>, tau_m: f64| {
            m.map_or(u128::MAX, square_units).min(units_of(tau_m * tau_m).into()) as u64
        };
        let mut lanes = [0; LANES];
        lanes[0] = 1;
        lanes[3] = u64::from(residuals.revisited);
        lanes[5] = given.iter().flatten().filter(|m| !m.is_finite()).count() as u64;
        let square = first.map_or(0, square_units);
        if let Some(m) = first {
            lanes[1] = 1;
            lanes[4] = u64::from(m > lengths.blocked_m);
            lanes[6] = if square < 1 << 50 { square as u64 } else { 0 };
            lanes[12..15].copy_from_slice(&lengths.near_m.map(|tau_m| cut(nearest, tau_m)));
        }
        if independent.is_some() {
            lanes[2] = 1;
            lanes[7..12].copy_from_slice(&lengths.cv_m.map(|tau_m| cut(independent, tau_m)));
        }
        let of_camera = |off: f64| if off.is_finite() { square_units(off) } else { 0 };
        let depth = residuals.depth.map(|depth| [of_camera(depth.first_m), of_camera(depth.first_sigmas)]);
        (lanes, if square < 1 << 50 { 0 } else { square }, if first.is_some() { depth } else { None })
    }

    /// Residuals of all sizes, around the truncations and where squares become long, or none.
    fn residual() -> impl Strategy<Value = Option<f64>> {
        let around = |m: f64| (m - 1e-6..m + 1e-6).prop_map(Some);
        let at = |m: f64| prop_oneof![Just(Some(m)), Just(Some(m.next_down())), Just(Some(m.next_up()))];
        prop_oneof![
            Just(None),
            prop_oneof![Just(f64::NAN), Just(f64::INFINITY), Just(f64::NEG_INFINITY)].prop_map(Some),
            prop_oneof![Just(0.0), Just(-0.0), Just(1e-300), Just(f64::MAX), Just(f64::MIN)].prop_map(Some),
            (-1.0..1.0f64).prop_map(Some),
            (-50.0..50.0f64).prop_map(Some),
            (-1e7..1e7f64).prop_map(Some),
            prop_oneof![around(0.5), around(-2.0), around(5.0), around(10.0), around(-30.0)],
            prop_oneof![at(32.0), at(-32.0), at(2_048f64.sqrt()), at(64.0), at(0.2), at(0.05)],
        ]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(4096))]
        #[test]
        fn squares_are_those_found_step_by_step(
            (first_m, nearest_m, independent_m) in (residual(), residual(), residual()),
            (depth_m, first_sigmas) in (residual(), residual()),
            (revisited, is_left_out) in any::<(bool, bool)>(),
        ) {
            let camera = depth_m.zip(first_sigmas);
            let depth = camera.map(|(first_m, first_sigmas)| DepthResidual { first_m, first_sigmas });
            let residuals =
                Residuals { first_m, nearest_m, independent_m, revisited, is_left_out, depth, ..Residuals::MISS };
            for &(scales, _) in Scales::ALL {
                let squares = Squares::of(&residuals, scales);
                prop_assert_eq!((squares.lanes, squares.far_first, squares.depth), slow(&residuals, scales));
            }
        }
    }

    #[test]
    fn blocked_means_short_by_more_than_half_a_metre() {
        let scales = Scales::Drive;
        let blocked = |first_m| {
            Squares::of(&Residuals { first_m: Some(first_m), ..Residuals::MISS }, scales).lanes[lane::BLOCKED]
        };
        assert_eq!([0.51, 0.5, -7.0].map(blocked), [1, 0, 0]);
        for first_m in [0.51, 0.5, 0.0, -0.5, -0.51, f64::NAN, f64::INFINITY] {
            let residuals = Residuals { first_m: Some(first_m), ..Residuals::MISS };
            assert_eq!(residuals.hit_kind(scales) == HitKind::Blocked, blocked(first_m) == 1, "{first_m}");
            let missed = Squares::of(&residuals, scales).lanes[lane::WITH_FIRST] == 0;
            assert_eq!(residuals.hit_kind(scales) == HitKind::Miss, missed);
            assert_eq!(residuals.hit_kind(scales) == HitKind::Beyond, first_m < -0.5);
        }
        assert_eq!(Residuals::MISS.hit_kind(scales), HitKind::Miss);
    }
}
