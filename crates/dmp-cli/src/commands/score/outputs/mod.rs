//! What `dmp score` writes beside its report: a page to look at, a scene for viewers, every scored return, scores by frame and by tile.

mod args;
mod gathered;
mod keep;
pub(crate) mod page;
mod per_frame;
mod per_tile;
mod pictures;
mod recorder;
mod residuals;
mod rows;
mod scene;
mod sketch;
mod spool;
pub(crate) mod targets;

pub(crate) use args::Outputs;
pub(crate) use recorder::{Recorded, Recorder};
