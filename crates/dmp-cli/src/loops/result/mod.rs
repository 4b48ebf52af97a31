//! What `dmp loops --json` prints.

mod collect;

use std::collections::BTreeMap;
use std::io::Write;

use dmp::ScaleScores;
use serde::Serialize;

use crate::Exit;

const SCHEMA: &str = "dmp-loops/1";

#[derive(Debug, Serialize)]
pub(in crate::loops) struct LoopsResult {
    schema: &'static str,
    dmp_version: &'static str,
    pub(in crate::loops) config: ConfigResult,
    pub(in crate::loops) inputs: InputsResult,
    pub(in crate::loops) without: WithoutResult,
    /// From best to worst.
    pub(in crate::loops) candidates: Vec<CandidateResult>,
    pub(in crate::loops) skipped: Vec<SkippedResult>,
    pub(in crate::loops) accepted: Option<AcceptedResult>,
    pub(in crate::loops) truth: Option<TruthResult>,
    /// Why there is none though labels were given.
    pub(in crate::loops) truth_withheld: Option<String>,
    pub(in crate::loops) timing: TimingResult,
    memory: MemoryResult,
}

#[derive(Debug, Serialize)]
pub(in crate::loops) struct ConfigResult {
    /// `map`, `map-direct` or `graph`.
    pub(in crate::loops) ranked_by: &'static str,
    pub(in crate::loops) voxel_m: Option<f64>,
    /// The truncation of `R_near` that ranks, metres; null where there is no log.
    pub(in crate::loops) scale_m: Option<f64>,
    /// Of maps that are put together of patches.
    rays_per_keyframe: Option<usize>,
    moved_m: Option<f64>,
    pub(in crate::loops) step_error: Option<[f64; 2]>,
    pub(in crate::loops) loop_error: Option<[f64; 2]>,
    pub(in crate::loops) loop_kernel: Option<String>,
}

#[derive(Debug, Serialize)]
pub(in crate::loops) struct InputsResult {
    pub(in crate::loops) graph: String,
    pub(in crate::loops) vertices: usize,
    pub(in crate::loops) edges: usize,
    pub(in crate::loops) candidates: String,
    pub(in crate::loops) log: Option<LogResult>,
}

#[derive(Debug, Serialize)]
pub(in crate::loops) struct LogResult {
    pub(in crate::loops) path: String,
    pub(in crate::loops) scans: usize,
    /// Of the patches; null where there are none.
    pub(in crate::loops) patches: Option<PatchesResult>,
    pub(in crate::loops) damage: Vec<String>,
}

#[derive(Debug, Serialize)]
pub(in crate::loops) struct PatchesResult {
    pub(in crate::loops) returns_used: u64,
    returns_dropped: BTreeMap<&'static str, u64>,
    pub(in crate::loops) keyframes_with_scans: usize,
    /// Cast into each map.
    pub(in crate::loops) rays: usize,
    file_bytes: u64,
}

/// The graph without candidates.
#[derive(Debug, Serialize)]
pub(in crate::loops) struct WithoutResult {
    /// As it was given, and optimised.
    pub(in crate::loops) chi2_before: f64,
    pub(in crate::loops) chi2: f64,
    pub(in crate::loops) iterations: usize,
    pub(in crate::loops) r_near_m2: Option<ScaleScores>,
}

#[derive(Debug, Clone, Serialize)]
pub(in crate::loops) struct CandidateResult {
    pub(in crate::loops) place: String,
    pub(in crate::loops) from: i64,
    pub(in crate::loops) to: i64,
    pub(in crate::loops) r_near_m2: Option<ScaleScores>,
    /// `R_near` at that truncation less that without it, over the returns that both maps predict.
    pub(in crate::loops) change_m2: Option<f64>,
    pub(in crate::loops) change_ci99_m2: Option<[f64; 2]>,
    pub(in crate::loops) largest_move_m: f64,
    pub(in crate::loops) moved_most: i64,
    pub(in crate::loops) largest_turn_rad: f64,
    pub(in crate::loops) chi2_change: f64,
    pub(in crate::loops) own_chi2: f64,
    pub(in crate::loops) iterations: usize,
    /// Share of the rays that were cast anew.
    cast_share: Option<f64>,
    pub(in crate::loops) label: Option<bool>,
}

#[derive(Debug, Serialize)]
pub(in crate::loops) struct SkippedResult {
    pub(in crate::loops) place: String,
    pub(in crate::loops) from: Option<i64>,
    pub(in crate::loops) to: Option<i64>,
    pub(in crate::loops) why: String,
}

#[derive(Debug, Serialize)]
pub(in crate::loops) struct AcceptedResult {
    pub(in crate::loops) accepted: usize,
    /// Had no score with those accepted before.
    failed: usize,
    pub(in crate::loops) r_near_m2: Option<f64>,
    pub(in crate::loops) chi2: f64,
    pub(in crate::loops) decisions: Vec<DecisionResult>,
    /// Of those with labels: how many of the accepted are true, and of all true ones how many are accepted.
    pub(in crate::loops) precision: Option<f64>,
    pub(in crate::loops) recall: Option<f64>,
}

#[derive(Debug, Serialize)]
pub(in crate::loops) struct DecisionResult {
    pub(in crate::loops) from: i64,
    pub(in crate::loops) to: i64,
    pub(in crate::loops) accepted: bool,
    /// `worse`, or what is wrong with it.
    pub(in crate::loops) why_not: Option<String>,
    /// How many had been accepted before.
    after: usize,
    change_m2: Option<f64>,
    change_ci99_m2: Option<[f64; 2]>,
    pub(in crate::loops) label: Option<bool>,
}

#[derive(Debug, Serialize)]
pub(in crate::loops) struct TruthResult {
    pub(in crate::loops) average_precision: f64,
    pub(in crate::loops) true_candidates: usize,
    pub(in crate::loops) false_candidates: usize,
    pub(in crate::loops) unlabelled: usize,
    /// Largest recall without a false one among those accepted.
    pub(in crate::loops) recall_without_false: f64,
    pub(in crate::loops) curve: Vec<CurveResult>,
}

#[derive(Debug, Serialize)]
pub(in crate::loops) struct CurveResult {
    score: f64,
    pub(in crate::loops) recall: f64,
    pub(in crate::loops) precision: f64,
}

#[derive(Debug, Serialize)]
pub(in crate::loops) struct TimingResult {
    pub(in crate::loops) read_s: f64,
    pub(in crate::loops) rank_s: f64,
    pub(in crate::loops) accept_s: f64,
    pub(in crate::loops) total_s: f64,
    threads: usize,
}

#[derive(Debug, Serialize)]
struct MemoryResult {
    budget_bytes: usize,
    peak_anon_bytes: Option<u64>,
}

impl LoopsResult {
    pub(in crate::loops) fn exit(&self) -> Exit {
        let damaged = self.inputs.log.as_ref().is_some_and(|log| !log.damage.is_empty());
        let failed = self.accepted.as_ref().is_some_and(|accepted| accepted.failed > 0);
        if damaged || failed || !self.skipped.is_empty() { Exit::InputDamaged } else { Exit::Done }
    }

    pub(in crate::loops) fn print_json(&self, out: &mut impl Write) -> anyhow::Result<()> {
        serde_json::to_writer_pretty(&mut *out, self).map_err(std::io::Error::from)?;
        Ok(writeln!(out)?)
    }
}
