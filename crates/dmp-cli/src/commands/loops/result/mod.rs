//! What `dmp loops --json` prints.

mod collect;

use std::collections::BTreeMap;

use dmp::ScaleScores;
use serde::Serialize;

use crate::console::Exit;

const SCHEMA: &str = "dmp-loops/1";

#[derive(Debug, Serialize)]
pub(crate) struct LoopsResult {
    schema: &'static str,
    dmp_version: &'static str,
    pub(crate) config: ConfigResult,
    pub(crate) inputs: InputsResult,
    pub(crate) without: WithoutResult,
    /// From best to worst.
    pub(crate) candidates: Vec<CandidateResult>,
    pub(crate) skipped: Vec<SkippedResult>,
    pub(crate) accepted: Option<AcceptedResult>,
    pub(crate) truth: Option<TruthResult>,
    /// Why there is none though labels were given.
    pub(crate) truth_withheld: Option<String>,
    pub(crate) timing: TimingResult,
    memory: MemoryResult,
}

#[derive(Debug, Serialize)]
pub(crate) struct ConfigResult {
    /// `map`, `map-direct` or `graph`.
    pub(crate) ranked_by: &'static str,
    pub(crate) voxel_m: Option<f64>,
    /// The truncation of `R_near` that ranks, metres; null where there is no log.
    pub(crate) scale_m: Option<f64>,
    /// Of maps that are put together of patches.
    rays_per_keyframe: Option<usize>,
    moved_m: Option<f64>,
    pub(crate) step_error: Option<[f64; 2]>,
    pub(crate) loop_error: Option<[f64; 2]>,
    pub(crate) loop_kernel: Option<String>,
}

#[derive(Debug, Serialize)]
pub(crate) struct InputsResult {
    pub(crate) graph: String,
    pub(crate) vertices: usize,
    pub(crate) edges: usize,
    pub(crate) candidates: String,
    pub(crate) log: Option<LogResult>,
}

#[derive(Debug, Serialize)]
pub(crate) struct LogResult {
    pub(crate) path: String,
    pub(crate) scans: usize,
    /// Of the patches; null where there are none.
    pub(crate) patches: Option<PatchesResult>,
    pub(crate) damage: Vec<String>,
}

#[derive(Debug, Serialize)]
pub(crate) struct PatchesResult {
    pub(crate) returns_used: u64,
    returns_dropped: BTreeMap<&'static str, u64>,
    pub(crate) keyframes_with_scans: usize,
    /// Cast into each map.
    pub(crate) rays: usize,
    file_bytes: u64,
}

/// The graph without candidates.
#[derive(Debug, Serialize)]
pub(crate) struct WithoutResult {
    /// As it was given, and optimised.
    pub(crate) chi2_before: f64,
    pub(crate) chi2: f64,
    pub(crate) iterations: usize,
    pub(crate) r_near_m2: Option<ScaleScores>,
}

#[derive(Debug, Clone, Serialize)]
pub(crate) struct CandidateResult {
    pub(crate) place: String,
    pub(crate) from: i64,
    pub(crate) to: i64,
    pub(crate) r_near_m2: Option<ScaleScores>,
    /// `R_near` at that truncation less that without it, over the returns that both maps predict.
    pub(crate) change_m2: Option<f64>,
    pub(crate) change_ci99_m2: Option<[f64; 2]>,
    pub(crate) largest_move_m: f64,
    pub(crate) moved_most: i64,
    pub(crate) largest_turn_rad: f64,
    pub(crate) chi2_change: f64,
    pub(crate) own_chi2: f64,
    pub(crate) iterations: usize,
    /// Share of the rays that were cast anew.
    cast_share: Option<f64>,
    pub(crate) label: Option<bool>,
}

#[derive(Debug, Serialize)]
pub(crate) struct SkippedResult {
    pub(crate) place: String,
    pub(crate) from: Option<i64>,
    pub(crate) to: Option<i64>,
    pub(crate) why: String,
}

#[derive(Debug, Serialize)]
pub(crate) struct AcceptedResult {
    pub(crate) accepted: usize,
    /// Had no score with those accepted before.
    failed: usize,
    pub(crate) r_near_m2: Option<f64>,
    pub(crate) chi2: f64,
    pub(crate) decisions: Vec<DecisionResult>,
    /// Of those with labels: how many of the accepted are true, and of all true ones how many are accepted.
    pub(crate) precision: Option<f64>,
    pub(crate) recall: Option<f64>,
}

#[derive(Debug, Serialize)]
pub(crate) struct DecisionResult {
    pub(crate) from: i64,
    pub(crate) to: i64,
    pub(crate) accepted: bool,
    /// `worse`, or what is wrong with it.
    pub(crate) why_not: Option<String>,
    /// How many had been accepted before.
    after: usize,
    change_m2: Option<f64>,
    change_ci99_m2: Option<[f64; 2]>,
    pub(crate) label: Option<bool>,
}

#[derive(Debug, Serialize)]
pub(crate) struct TruthResult {
    pub(crate) average_precision: f64,
    pub(crate) true_candidates: usize,
    pub(crate) false_candidates: usize,
    pub(crate) unlabelled: usize,
    /// Largest recall without a false one among those accepted.
    pub(crate) recall_without_false: f64,
    pub(crate) curve: Vec<CurveResult>,
}

#[derive(Debug, Serialize)]
pub(crate) struct CurveResult {
    score: f64,
    pub(crate) recall: f64,
    pub(crate) precision: f64,
}

#[derive(Debug, Serialize)]
pub(crate) struct TimingResult {
    pub(crate) read_s: f64,
    pub(crate) rank_s: f64,
    pub(crate) accept_s: f64,
    pub(crate) total_s: f64,
    threads: usize,
}

#[derive(Debug, Serialize)]
struct MemoryResult {
    budget_bytes: usize,
    peak_anon_bytes: Option<u64>,
}

impl LoopsResult {
    pub(crate) fn exit(&self) -> Exit {
        let damaged = self.inputs.log.as_ref().is_some_and(|log| !log.damage.is_empty());
        let failed = self.accepted.as_ref().is_some_and(|accepted| accepted.failed > 0);
        if damaged || failed || !self.skipped.is_empty() { Exit::InputDamaged } else { Exit::Done }
    }
}
