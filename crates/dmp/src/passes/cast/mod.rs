//! Casts rays into every run's map and reduces the residuals.

mod casters;
mod checkpoint;
mod copies;
mod odd;
mod part;
mod pass;
mod rows;
mod worker;

pub(crate) use casters::{RunCaster, horizon_m};
pub use checkpoint::Casting;
pub use copies::CopiedScans;
pub use odd::{OddScans, Oddity};
pub(crate) use pass::Scored;
