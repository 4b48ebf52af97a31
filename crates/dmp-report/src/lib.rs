//! The report of a score: plain data, read from JSON and written to it with serde, and the questions that it answers.
//!
//! A [`Report`] holds what was read and set, each run's scores, each pair's verdict and the order of the runs. Nothing here
//! reads a log.

mod answers;
mod columns;
mod contents;
mod made_with;
mod map_check;
mod pair;
mod ranks;
mod run;
#[cfg(test)]
mod sample_data;
mod scores;
#[cfg(test)]
mod tests;
mod verdict;
mod withheld;

pub use answers::Best;
pub use columns::{COLUMNS, Column, ColumnUnit, columns_by_rank};
pub use contents::Report;
pub use dmp_map::{Layers, Thickness};
pub use made_with::{
    ConfigReport, ConventionsReport, DepthNoiseReport, DropReport, Ego, EgoReport, EstimateReport,
    InputReport, LeftOutReport, MemoryReport, Pairing, PassTimes, PoseAt, PromiseReport, QuickReport,
    RunInputReport, SamplingReport, SegmentLength, SegmentReport, TileReport,
};
pub use map_check::{GroundPlan, Holes, MapCheck, PlanColumn};
pub use pair::{PairFacts, PairReport, ScaleReport};
pub use run::{MapReport, RunFacts, RunReport};
pub use scores::ScaleScores;
pub use verdict::Verdict;
pub use withheld::Withheld;
