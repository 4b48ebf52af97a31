//! What a map predicts for one return, beside what was measured.

use crate::basis::Basis;
use crate::fixed::{near_square_units, square_units};
use crate::scales::{CV, Scales, TRUNCATED_BITS, limits};
use crate::surface::SurfaceGroup;

/// What one run's map predicts for one return, as residuals z − z' in metres: measured range minus
/// predicted range (Zhang & Chen 2021, eq. 6–7). `None` is a miss: a value, never a range.
///
/// A residual that is NaN or infinite counts as a miss, and [`RunSums::non_finite`] counts it.
///
/// [`RunSums::non_finite`]: crate::RunSums::non_finite
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Residuals {
    /// z − z1, to the first surfel crossed: the paper's residual.
    pub first_m: Option<f64>,
    /// z − zn, to the crossing nearest to z; `None` where there is none within the widest scale of `R_near` of z.
    pub nearest_m: Option<f64>,
    /// z − zc, to the first independent surfel crossed.
    pub independent_m: Option<f64>,
    /// Whether an independent crossing exists even when five segments to either side are left out.
    pub revisited: bool,
    /// Of a depth camera, where there is a z1: the first residual as the camera has it.
    pub depth: Option<DepthResidual>,
    /// Which surface of the map the prediction by which the run is judged lies on, first for `R_cv`, then for `R_near`
    /// ([`Basis`]); where there is none, the place of the return. By which the run is judged neither alone nor in a pair may be
    /// [`SurfaceGroup::NONE`].
    pub surfaces: [SurfaceGroup; 2],
}

/// The residual of a depth camera's own number: depth along the optical axis, not range along the ray.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct DepthResidual {
    /// Measured minus predicted depth, metres: the paper's z − z' for depth images.
    pub first_m: f64,
    /// The same in parts of the camera's noise at that depth.
    pub first_sigmas: f64,
}

/// What the ray of a return meets first in a map, beside the return.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HitKind {
    /// Nothing: what [`RunSums::miss_rate`](crate::RunSums::miss_rate) counts.
    Miss,
    /// A surfel at most [`Lengths::blocked_m`](crate::Lengths) from the return.
    Hit,
    /// A surfel more than that in front of the return: what [`RunSums::blocked_rate`](crate::RunSums::blocked_rate)
    /// counts.
    Blocked,
    /// A surfel more than that behind the return, and none in front of it.
    Beyond,
}

impl Residuals {
    /// What the ray meets first.
    pub fn hit_kind(&self, scales: Scales) -> HitKind {
        let blocked_m = scales.lengths().blocked_m;
        match self.first_m.filter(|m| m.is_finite()) {
            None => HitKind::Miss,
            Some(m) if m > blocked_m => HitKind::Blocked,
            Some(m) if m < -blocked_m => HitKind::Beyond,
            Some(_) => HitKind::Hit,
        }
    }

    /// A return at which nothing is crossed at all.
    pub const MISS: Self = Self {
        first_m: None,
        nearest_m: None,
        independent_m: None,
        revisited: false,
        depth: None,
        surfaces: [SurfaceGroup::NONE; 2],
    };

    /// One surfel crossed, independent of the return and revisited, `residual_m` short of it.
    pub fn all(residual_m: f64) -> Self {
        let residual = Some(residual_m);
        Self {
            first_m: residual,
            nearest_m: residual,
            independent_m: residual,
            revisited: true,
            depth: None,
            surfaces: [SurfaceGroup::NONE; 2],
        }
    }
}

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

/// Numbers of [`Squares::lanes`]; the last one is 0, so that they are even.
pub(crate) const LANES: usize = 16;

/// Which number of [`Squares::lanes`] is what.
pub(crate) mod lane {
    use crate::scales::{CV, NEAR};
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
}

impl Squares {
    /// Of residuals that are judged by these lengths.
    #[inline]
    pub fn of(residuals: &Residuals, scales: Scales) -> Self {
        let limits = limits(scales);
        let given = [residuals.first_m, residuals.nearest_m, residuals.independent_m];
        let [first, nearest, independent] = given.map(|r| r.filter(|m| m.is_finite()));
        let finite = [first, nearest, independent].iter().flatten().count();
        let mut lanes = [0; LANES];
        lanes[lane::RETURNS] = 1;
        lanes[lane::REVISITED] = u64::from(residuals.revisited);
        lanes[lane::NON_FINITE] = (given.iter().flatten().count() - finite) as u64;
        let mut far_first = 0;
        if let Some(first_m) = first {
            lanes[lane::WITH_FIRST] = 1;
            lanes[lane::BLOCKED] = u64::from(first_m > scales.lengths().blocked_m);
            let square = square_units(first_m);
            if square < 1 << TRUNCATED_BITS {
                lanes[lane::FIRST] = square as u64;
            } else {
                far_first = square;
            }
            // Without a crossing near z the square is the full τ²: no scale is larger than the window
            // in which one was looked for.
            let square = nearest.map_or(u64::MAX, near_square_units);
            lanes[lane::NEAR_SQUARES].copy_from_slice(&cut(square, limits.near));
        }
        if let Some(independent_m) = independent {
            lanes[lane::WITH_INDEPENDENT] = 1;
            lanes[lane::CV_SQUARES].copy_from_slice(&cut(near_square_units(independent_m), limits.cv));
        }
        let depth = first.and(residuals.depth).map(|depth| {
            [depth.first_m, depth.first_sigmas].map(|off| if off.is_finite() { square_units(off) } else { 0 })
        });
        Self { lanes, far_first, depth, surfaces: residuals.surfaces }
    }

    /// The piece of surface that a prediction of `basis` lies on.
    #[inline]
    pub(crate) fn surface_on(&self, basis: Basis) -> SurfaceGroup {
        match basis {
            Basis::CrossValidated => self.surfaces[0],
            Basis::Near => self.surfaces[1],
        }
    }

    /// The truncated squares by which a run counts in a pair of `basis`, at the scales of the basis, zeros behind.
    #[inline]
    pub(crate) fn on(&self, basis: Basis) -> Option<[u64; CV]> {
        let (counts, squares) = match basis {
            Basis::CrossValidated => (self.lanes[lane::WITH_INDEPENDENT], lane::CV_SQUARES),
            Basis::Near => (self.lanes[lane::WITH_FIRST], lane::NEAR_SQUARES),
        };
        (counts > 0).then(|| {
            let mut on = [0; CV];
            on[..squares.len()].copy_from_slice(&self.lanes[squares]);
            on
        })
    }
}

/// A square truncated at every limit. Rounding is monotone: the rounded square cut at the rounded τ² is
/// the cut square rounded.
#[inline]
fn cut<const N: usize>(square: u64, limits: [u64; N]) -> [u64; N] {
    limits.map(|limit| square.min(limit))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_residual_that_is_no_number_is_a_counted_miss() {
        let residuals = Residuals {
            first_m: Some(f64::INFINITY),
            nearest_m: Some(0.1),
            independent_m: Some(f64::NAN),
            ..Residuals::MISS
        };
        let squares = Squares::of(&residuals, Scales::Drive);
        assert_eq!((squares.on(Basis::Near), squares.on(Basis::CrossValidated)), (None, None));
        let expected = [1, 0, 0, 0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];
        assert_eq!((squares.lanes, squares.far_first), (expected, 0));
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

    #[test]
    fn without_a_crossing_near_the_range_the_square_is_full() {
        let squares = Squares::of(&Residuals { first_m: Some(20.0), ..Residuals::MISS }, Scales::Drive);
        assert_eq!(squares.on(Basis::Near), Some([25 << 40, 4 << 40, 1 << 38, 0, 0]));
    }

    #[test]
    fn a_square_is_near_or_far() {
        for first_m in [0.1, 31.9, 32.0, 33.0, 1e4, 1e9] {
            let squares =
                Squares::of(&Residuals { first_m: Some(first_m), ..Residuals::MISS }, Scales::Drive);
            let near = squares.lanes[lane::FIRST];
            assert!(near < 1 << TRUNCATED_BITS && (near == 0) == (first_m >= 32.0));
            assert_eq!(u128::from(near) + squares.far_first, square_units(first_m));
        }
    }
}
