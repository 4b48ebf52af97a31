//! What is kept of a return, so that its run can be compared with runs that are scored another day.

use super::basis::Basis;
use super::residuals::Residuals;
use super::scales::Scales;
use super::surface::SurfaceGroup;

/// Steps of a kept residual in a metre of the lengths: those of the lattice on which voxels are summed.
const STEPS: f64 = (1 << 13) as f64;

/// All that comparing runs needs to know of one return in one run: how far the prediction by which the run is judged is
/// off, and on which piece of surface it lies.
///
/// The residual is kept without its sign in steps of 2⁻¹³ m, a tenth of that in a room, and cut off where
/// [`Lengths::cv_m`](crate::Lengths) is widest. Rounding moves a mean square by a twelfth of a step squared, 10⁻⁹ m², in
/// both runs alike: verdicts are those of exact residuals but where an interval ends at 0 to a few digits, or where all residuals are
/// below a step, as in a simulation without noise.
///
/// ```
/// use dmp_reduce::{Basis, KeptReturn, Residuals, Scales};
///
/// let kept = KeptReturn::of(&Residuals::all(-0.25), Basis::CrossValidated, Scales::Drive);
/// let back = KeptReturn::from_bytes(kept.to_bytes());
/// assert_eq!(back.residuals(Basis::CrossValidated, Scales::Drive).independent_m, Some(0.25));
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct KeptReturn {
    /// One more than the steps; 0 where nothing is predicted.
    code: u32,
    surface: SurfaceGroup,
    revisited: bool,
}

/// Of the last byte: the group of surface is below.
const REVISITED: u8 = 1 << 7;

impl KeptReturn {
    /// As many bytes as it has: the code, its low byte first, and the group of surface, with the highest bit where it is
    /// revisited.
    pub const BYTES: usize = 4;

    /// What is kept of a return in a run that is judged by `basis`.
    #[inline]
    pub fn of(residuals: &Residuals, basis: Basis, scales: Scales) -> Self {
        let finite = |m: Option<f64>| m.filter(|m| m.is_finite() && !residuals.is_left_out);
        let [of_cv, of_near] = residuals.surfaces;
        let (residual_m, surface) = match basis {
            Basis::CrossValidated => (finite(residuals.independent_m), of_cv),
            // Without a crossing near z the square is full.
            Basis::Near => (
                finite(residuals.first_m).map(|_| finite(residuals.nearest_m).unwrap_or(f64::INFINITY)),
                of_near,
            ),
        };
        let steps = |m: f64| (m.abs().min(scales.lengths().cv_m[0]) / step_m(scales)).round() as u32;
        let revisited = residuals.revisited && residual_m.is_some();
        Self { code: residual_m.map_or(0, |m| 1 + steps(m)), surface, revisited }
    }

    /// Residuals that count in a pair as those that it was made of.
    #[inline]
    pub fn residuals(self, basis: Basis, scales: Scales) -> Residuals {
        let residual_m = self.code.checked_sub(1).map(|steps| f64::from(steps) * step_m(scales));
        let surfaces = [self.surface; 2];
        let known = Residuals { surfaces, revisited: self.revisited, ..Residuals::MISS };
        match basis {
            Basis::CrossValidated => Residuals { independent_m: residual_m, ..known },
            Basis::Near => Residuals { first_m: residual_m, nearest_m: residual_m, ..known },
        }
    }

    /// As bytes.
    #[inline]
    pub fn to_bytes(self) -> [u8; Self::BYTES] {
        let [low, middle, high, _] = self.code.to_le_bytes();
        [low, middle, high, self.surface.index() as u8 | if self.revisited { REVISITED } else { 0 }]
    }

    /// Of bytes; any are those of some return.
    #[inline]
    pub fn from_bytes([low, middle, high, last]: [u8; Self::BYTES]) -> Self {
        let code = u32::from_le_bytes([low, middle, high, 0]);
        let surface = SurfaceGroup::of_number(last & !REVISITED);
        Self { code, surface, revisited: last & REVISITED != 0 }
    }
}

/// How long a step is, metres.
#[inline]
fn step_m(scales: Scales) -> f64 {
    scales.lengths().metre_m / STEPS
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_return_comes_back_to_half_a_step() {
        for (scales, step_m) in [(Scales::Drive, 1.0 / 8192.0), (Scales::Room, 0.1 / 8192.0)] {
            let widest_m = scales.lengths().cv_m[0];
            for k in 0..10_000 {
                let residual_m = 1.001f64.powi(k - 9_000) * if k % 2 == 0 { -1.0 } else { 1.0 };
                for basis in [Basis::CrossValidated, Basis::Near] {
                    let surface = SurfaceGroup::of_cube([k, 0, 0]);
                    let revisited = k % 3 == 0;
                    let given = Residuals { surfaces: [surface; 2], revisited, ..Residuals::all(residual_m) };
                    let kept = KeptReturn::of(&given, basis, scales);
                    let bytes = kept.to_bytes();
                    assert_eq!(KeptReturn::from_bytes(bytes), kept);
                    let back = kept.residuals(basis, scales);
                    let back_m = back.independent_m.or(back.nearest_m).unwrap();
                    let off_m = (back_m - residual_m.abs().min(widest_m)).abs();
                    assert!(off_m <= 0.500_000_1 * step_m, "{residual_m}: {back_m}");
                    assert_eq!((back.surfaces, back.revisited), (given.surfaces, revisited));
                }
            }
        }
    }
}
