//! What a map predicts for one return, beside what was measured.

use crate::basis::Basis;
use crate::fixed::{near_square_units, square_units};
use crate::scales::{CV, NEAR, Scales, limits};
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
    /// ([`Basis`]); where there is none, the place of the return.
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
pub(crate) struct Squares {
    /// (z − z1)², where there is a z1.
    pub(crate) first: Option<u128>,
    /// min((z − zn)², τ²) at the scales of `R_near`, zeros behind, where there is a z1.
    pub(crate) nearest: Option<[u64; CV]>,
    /// min((z − zc)², τ²) at the scales of `R_cv`, where there is a zc.
    pub(crate) independent: Option<[u64; CV]>,
    /// (z − z1)² of a depth camera's own number, and in parts of its noise.
    pub(crate) depth: Option<[u128; 2]>,
    pub(crate) revisited: bool,
    pub(crate) blocked: bool,
    pub(crate) non_finite: u8,
    surfaces: [SurfaceGroup; 2],
}

impl Squares {
    #[inline]
    pub(crate) fn of(residuals: &Residuals, scales: Scales) -> Self {
        let limits = limits(scales);
        let given = [residuals.first_m, residuals.nearest_m, residuals.independent_m];
        let [first, nearest, independent] = given.map(|r| r.filter(|m| m.is_finite()));
        let finite = [first, nearest, independent].iter().flatten().count();
        Self {
            first: first.map(square_units),
            nearest: first.map(|_| {
                // Without a crossing near z the square is the full τ²: no scale is larger than the window
                // in which one was looked for.
                let square = nearest.map_or(u64::MAX, near_square_units);
                let mut cut_at = [0; CV];
                cut_at[..NEAR].copy_from_slice(&cut(square, limits.near));
                cut_at
            }),
            independent: independent.map(|m| cut(near_square_units(m), limits.cv)),
            depth: first.and(residuals.depth).map(|depth| {
                [depth.first_m, depth.first_sigmas]
                    .map(|off| if off.is_finite() { square_units(off) } else { 0 })
            }),
            revisited: residuals.revisited,
            blocked: first.is_some_and(|m| m > scales.lengths().blocked_m),
            non_finite: (given.iter().flatten().count() - finite) as u8,
            surfaces: residuals.surfaces,
        }
    }

    /// The piece of surface that a prediction of `basis` lies on.
    #[inline]
    pub(crate) fn surface_on(&self, basis: Basis) -> SurfaceGroup {
        match basis {
            Basis::CrossValidated => self.surfaces[0],
            Basis::Near => self.surfaces[1],
        }
    }

    /// The truncated squares by which a run counts in a pair of `basis`, at the scales of the basis.
    #[inline]
    pub(crate) fn on(&self, basis: Basis) -> Option<&[u64; CV]> {
        match basis {
            Basis::CrossValidated => self.independent.as_ref(),
            Basis::Near => self.nearest.as_ref(),
        }
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
        assert_eq!((squares.first, squares.nearest, squares.independent), (None, None, None));
        assert!(!squares.blocked);
        assert_eq!(squares.non_finite, 2);
    }

    #[test]
    fn blocked_means_short_by_more_than_half_a_metre() {
        let scales = Scales::Drive;
        let blocked =
            |first_m| Squares::of(&Residuals { first_m: Some(first_m), ..Residuals::MISS }, scales).blocked;
        assert!(blocked(0.51));
        assert!(!blocked(0.5));
        assert!(!blocked(-7.0));
        for first_m in [0.51, 0.5, 0.0, -0.5, -0.51, f64::NAN, f64::INFINITY] {
            let residuals = Residuals { first_m: Some(first_m), ..Residuals::MISS };
            assert_eq!(
                residuals.hit_kind(scales) == HitKind::Blocked,
                Squares::of(&residuals, scales).blocked,
                "{first_m}"
            );
            let missed = Squares::of(&residuals, scales).first.is_none();
            assert_eq!(residuals.hit_kind(scales) == HitKind::Miss, missed);
            assert_eq!(residuals.hit_kind(scales) == HitKind::Beyond, first_m < -0.5);
        }
        assert_eq!(Residuals::MISS.hit_kind(scales), HitKind::Miss);
    }

    #[test]
    fn without_a_crossing_near_the_range_the_square_is_full() {
        let squares = Squares::of(&Residuals { first_m: Some(20.0), ..Residuals::MISS }, Scales::Drive);
        assert_eq!(squares.nearest, Some([25 << 40, 4 << 40, 1 << 38, 0, 0]));
    }
}
