//! A return beside what a map predicts for it, and the lengths by which it is judged.

mod basis;
mod kept;
mod price;
mod residuals;
mod scales;
mod squares;
mod surface;

pub use basis::Basis;
pub use kept::KeptReturn;
pub use price::MissPrice;
pub use residuals::{DepthResidual, HitKind, Residuals};
pub(crate) use scales::{CV, NEAR, TRUNCATED_BITS, WIDEST};
pub use scales::{Lengths, Reach, Scales};
pub use squares::Squares;
pub(crate) use squares::{LANES, lane};
pub(crate) use surface::GROUPS;
pub use surface::{SurfaceGroup, floor};
