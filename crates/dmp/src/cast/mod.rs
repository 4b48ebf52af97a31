//! Casting: rays into every run's map, and what they leave.

mod casters;
mod pass;
mod shapes;
mod worker;

pub(crate) use casters::{RunCaster, horizon_m};
pub(crate) use pass::Scored;
pub(crate) use shapes::ScanShape;
pub use shapes::{OddScan, Oddity};
