//! The maps of all runs: fused from the scans, or given; kept for another process, and taken up by it.

mod files;
mod kept;
mod maps;
mod part;
mod pass;

pub(crate) use files::{Life, finish};
pub(crate) use kept::KeptMaps;
