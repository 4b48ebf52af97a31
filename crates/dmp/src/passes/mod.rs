//! The passes over a log: plan, foresee, fuse, find trails, doubt, cast, measure drift. Each is a verb of an [`Evaluation`].

mod cast;
mod drift;
mod evaluation;
mod foresight;
mod frames;
mod fuse;
mod given;
mod plan;
mod reach;
mod run_map;
mod sanity;
mod schedule;
mod survey;
mod trails;

pub use cast::{Casting, CopiedScans, OddScans, Oddity};
pub(crate) use cast::{RunCaster, Scored, horizon_m};
pub use drift::{Revisits, VisitPair, measure_drift};
pub(crate) use evaluation::{Evaluation, FuseTotals, Task};
pub(crate) use foresight::DiskEstimate;
pub(crate) use frames::{Worker, each_frame, jobs_of};
pub(crate) use fuse::{Finished, Life, finish};
pub(crate) use given::{fuse_given, sparse};
pub(crate) use plan::Plan;
pub use reach::TilesInReach;
pub(crate) use run_map::{MapFacts, RunMap, tile_bytes};
pub(crate) use sanity::Doubts;
pub use survey::Surveyed;
