//! Casting: rays into every run's map, and what they leave.

mod casters;
mod pass;
mod worker;

pub(crate) use casters::{RunCaster, horizon_m};
pub(crate) use pass::Scored;
