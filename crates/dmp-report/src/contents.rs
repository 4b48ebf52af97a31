//! The whole of a report.

use dmp_revisit::drift::{DriftReport, RunDrift};
use serde::{Deserialize, Serialize, Serializer};

use crate::made_with::InputReport;
use crate::made_with::LeftOutReport;
use crate::made_with::SamplingReport;
use crate::made_with::{ConfigReport, PromiseReport};
use crate::made_with::{MemoryReport, PassTimes, TileReport};
use crate::pair::PairReport;
use crate::run::RunReport;

/// What an evaluation found. Serialised, it is the command's JSON: schema `dmp-score/3`, described in
/// `docs/json.md`. Other fields beside these, as the command's `gates`, are passed over when one is read.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Always `dmp-score/3`.
    pub schema: String,
    /// Version of this program.
    pub dmp_version: String,
    /// The settings as they took effect.
    pub config: ConfigReport,
    /// What was read, used and dropped.
    pub inputs: InputReport,
    /// The runs, in the order given.
    pub runs: Vec<RunReport>,
    /// Runs that were given too and are no part of what is compared.
    #[serde(default)]
    pub left_out: Vec<LeftOutReport>,
    /// Names of the runs, best first.
    pub order: Vec<String>,
    /// Neighbours of that order that share a rank.
    pub ties: Vec<[String; 2]>,
    /// Every pair of runs.
    pub pairs: Vec<PairReport>,
    /// How far the runs are off where they come back, in metres; null where that was not measured. The JSON has no single
    /// visits: `dmp::measure_drift` has them.
    #[serde(default, serialize_with = "without_visits")]
    pub drift: Option<DriftReport>,
    /// What the verdicts on them promise, all together.
    pub promise: PromiseReport,
    /// How much of the log was scored.
    pub sampling: SamplingReport,
    /// What a reader must know before believing any of it.
    pub warnings: Vec<String>,
    /// How long it took.
    pub timing: PassTimes,
    /// What it needed.
    pub memory: MemoryReport,
    /// Each run's sums by tile, where `Config::per_tile` asks for them; not part of the JSON.
    #[serde(skip)]
    pub tiles: Vec<TileReport>,
}

impl Report {
    /// What `schema` says.
    pub const SCHEMA: &str = "dmp-score/3";

    /// Whether the run of this name may be misread, or that of another log.
    pub fn is_doubtful(&self, run: &str) -> bool {
        let of_run = self.inputs.runs.iter().find(|input| input.name == run);
        of_run.and_then(|input| input.conventions.as_ref()).is_some_and(|found| found.doubtful)
    }
}

/// A visit has a hundred numbers in each run.
#[expect(clippy::ref_option, reason = "serde gives it so")]
fn without_visits<S: Serializer>(drift: &Option<DriftReport>, serializer: S) -> Result<S::Ok, S::Error> {
    let without = |run: &RunDrift| RunDrift { visits: Vec::new(), ..run.clone() };
    let of_runs = drift
        .as_ref()
        .map(|drift| DriftReport { runs: drift.runs.iter().map(without).collect(), ..drift.clone() });
    of_runs.serialize(serializer)
}
