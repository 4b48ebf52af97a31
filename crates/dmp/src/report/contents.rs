//! The whole of a report.

use serde::{Deserialize, Serialize};

use super::conventions::LeftOutReport;
use super::effort::{MemoryReport, PassTimes, TileReport};
use super::inputs::InputReport;
use super::pair::PairReport;
use super::run::{FreeSpaceReport, RunReport};
use super::sampling::SamplingReport;
use super::settings::{ConfigReport, PromiseReport};
use super::warning::Warning;

/// What an evaluation found. Serialised, it is the command's JSON: schema `dmp-score/2`, described in
/// `docs/json.md`. Other fields beside these, as the command's `gates`, are passed over when one is read.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Always `dmp-score/2`.
    pub schema: String,
    /// Version of this program.
    pub dmp_version: String,
    /// The settings as they took effect.
    pub config: ConfigReport,
    /// What was read, used and dropped.
    pub inputs: InputReport,
    /// What was kept out of all maps; null where trails were not looked for.
    pub free_space: Option<FreeSpaceReport>,
    /// The runs, in the order given.
    pub runs: Vec<RunReport>,
    /// Runs that were given too and are no part of what is compared.
    #[serde(default)]
    pub left_out: Vec<LeftOutReport>,
    /// Names of the runs, best first.
    pub order: Vec<String>,
    /// Neighbours of that order between which nothing is decided.
    pub ties: Vec<[String; 2]>,
    /// Every pair of runs.
    pub pairs: Vec<PairReport>,
    /// What the verdicts on them promise, all together.
    pub promise: PromiseReport,
    /// How much of the log was scored.
    pub sampling: SamplingReport,
    /// What a reader must know before believing any of it.
    pub warnings: Vec<Warning>,
    /// How long it took.
    pub timing: PassTimes,
    /// What it needed.
    pub memory: MemoryReport,
    /// Each run's sums by tile; not part of the JSON.
    #[serde(skip)]
    pub tiles: Vec<TileReport>,
}

impl Report {
    /// What `schema` says.
    pub const SCHEMA: &str = "dmp-score/2";
}
