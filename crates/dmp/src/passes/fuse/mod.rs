//! The maps of all runs: fused from the scans or given, checkpointed and resumed.

mod checkpoint;
mod files;
mod kept;
mod maps;
mod part;
mod pass;

pub(crate) use checkpoint::Fused;
pub(crate) use files::{Finished, Life, finish};
pub(crate) use kept::KeptMaps;
