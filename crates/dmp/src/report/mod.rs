//! What an evaluation found: the report, how it is built of the sums, how it is asked, what it warns of.

mod answers;
mod build;
mod columns;
mod contents;
mod conventions;
mod effort;
mod ego;
mod inputs;
mod pair;
mod run;
#[cfg(test)]
pub(crate) mod sample_data;
mod sampling;
mod scores;
mod settings;
mod verdict;
mod warnings;
mod withheld;

pub use answers::Best;
pub use columns::{COLUMNS, Column, ColumnUnit, columns_by_rank};
pub use contents::Report;
pub use conventions::{ConventionsReport, EstimateReport, LeftOutReport};
pub use effort::{MemoryReport, PassTimes, TileReport};
pub use ego::EgoReport;
pub use inputs::{DropReport, InputReport, RunInputReport};
pub use pair::{PairReport, ScaleReport};
pub use run::{MapReport, RunReport};
pub use sampling::{PlacesReport, SamplingReport};
pub use scores::ScaleScores;
pub use settings::{ConfigReport, DepthNoiseReport, PromiseReport, SegmentReport};
pub use verdict::Verdict;
pub use withheld::Withheld;

pub(crate) use build::{Findings, MapSummary, drops_in_words, map_report, segment_report};
pub(crate) use pair::PairFacts;
