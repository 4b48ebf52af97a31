//! What a map predicts for one return, beside what was measured.

use super::scales::Scales;
use super::surface::SurfaceGroup;

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
    /// Whether the map left out the place of the return, since things move there: it is counted and not scored.
    pub is_left_out: bool,
    /// Of a depth camera, where there is a z1: the first residual as the camera has it.
    pub depth: Option<DepthResidual>,
    /// Which surface of the map the prediction by which the run is judged lies on, first for `R_cv`, then for `R_near`
    /// ([`Basis`](crate::Basis)); where there is none, the place of the return. By which the run is judged neither alone nor in a pair may be
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
    /// Whatever it meets: the map left out the place of the return.
    LeftOut,
}

impl Residuals {
    /// What the ray meets first.
    pub fn hit_kind(&self, scales: Scales) -> HitKind {
        if self.is_left_out {
            return HitKind::LeftOut;
        }
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
        is_left_out: false,
        depth: None,
        surfaces: [SurfaceGroup::NONE; 2],
    };

    /// A return whose place the map left out.
    pub const LEFT_OUT: Self = Self { is_left_out: true, ..Self::MISS };

    /// One surfel crossed, independent of the return and revisited, `residual_m` short of it.
    pub fn all(residual_m: f64) -> Self {
        let residual = Some(residual_m);
        Self {
            first_m: residual,
            nearest_m: residual,
            independent_m: residual,
            revisited: true,
            is_left_out: false,
            depth: None,
            surfaces: [SurfaceGroup::NONE; 2],
        }
    }
}
