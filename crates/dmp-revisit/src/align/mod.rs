//! How far apart a run put the same surfaces on two visits of a place.
//!
//! Where two visits see the same surfaces, the motion that brings the surfels of one onto those of the other is the run's own
//! error between them. [`align`] finds it, says how well it is known, and fails where the surfaces do not determine it: a
//! registration of patches, coarse to fine, from both sides.
//!
//! 1. Points of a visit become a [`dmp_map::PatchBuilder`], in the frame of the place; this a [`Pyramid`] of surfels at
//!    voxels of 4, 2 and 1 times the patch's.
//! 2. Point to plane: of a surfel's mean to the plane of the nearest surfel of the other visit whose normal is alike
//!    (Low 2004, "Linear Least-Squares Optimization for Point-to-Plane ICP Surface Registration"), weighted by
//!    Geman and McClure's function (Chebrolu et al. 2021, "Adaptive Robust Kernels for Non-Linear Least Squares
//!    Problems", eq. 2 with α = −2), by Gauss and Newton's method.
//! 3. Gates: both directions agree, enough is seen by both, surfaces hold the motion in every direction but one, they do
//!    not match as well elsewhere, and they lie as near to each other as they are thick: those of another place that looks
//!    alike do not. Along a direction that they do not hold, as along a corridor, the guess stands (after
//!    Zhang, Kaess and Singh 2016, "On Degeneracy of Optimization-based State Estimation Problems").
//!
//! Lengths are multiples of the patch's voxel, so that a room is a small street. Nothing here reads a file or starts a
//! thread; only + − × ÷ and square roots, in a fixed order: the bits are the same everywhere.
//!
//! ```
//! use dmp_revisit::align::{Pyramid, align};
//! use dmp_map::{Lattice, PatchBuilder};
//!
//! // The corner of a yard, seen twice; the second time 20 cm to the side.
//! let yard = |shift_m: f64| {
//!     let places = (0..40_000).map(|k| [k % 200, k / 200].map(|n| f64::from(n) * 0.05));
//!     places.flat_map(move |[a, b]| [[a, b, 0.1], [0.1, a, b], [a, 0.1, b]].map(|[x, y, z]| [x + shift_m, y, z]))
//! };
//! let visit = |shift_m| -> Result<Pyramid, dmp_map::MapError> {
//!     let mut patch = PatchBuilder::new(Lattice::new(0.5)?);
//!     patch.add(&yard(shift_m).collect::<Vec<_>>())?;
//!     Ok(Pyramid::new(&patch))
//! };
//! let found = align(&visit(0.0)?, &visit(0.2)?, &[])?;
//! assert!((found.target_from_source.translation.x + 0.2).abs() < 0.01);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod difference;
mod elsewhere;
mod flat;
mod grid;
mod held;
mod level;
mod normal_equations;
mod pyramid;
mod refusal;
mod register;
mod side;
mod starts;
#[cfg(test)]
mod tests;

pub use pyramid::Pyramid;
pub use refusal::Refusal;
pub use register::{Alignment, align};
