//! The repair of a run, as `dmp repair --json` prints it: schema `dmp-repair/1`, described in `docs/json.md`.

use dmp::{DriftComparison, DriftReport, PairReport, Report, Run, RunDrift, RunReport};
use dmp_loops::{Outcome, Repair, Round};
use serde::Serialize;

#[derive(Debug, Serialize)]
pub(super) struct RepairResult {
    schema: &'static str,
    dmp_version: &'static str,
    /// Name of the run.
    pub(super) run: String,
    /// `repaired`, or why it is left as it is.
    pub(super) outcome: &'static str,
    /// Whether the output was written.
    pub(super) is_written: bool,
    pub(super) rounds: Vec<RoundResult>,
    /// The run before and after.
    pub(super) drift: Option<DriftResult>,
    pub(super) score: Option<ScoreResult>,
}

#[derive(Debug, Serialize)]
pub(super) struct RoundResult {
    pub(super) pairs_found: usize,
    pub(super) pairs_measured: usize,
    pub(super) constraints: usize,
    pub(super) consistent: usize,
    pub(super) accepted: usize,
    /// What the run's steps err by over a metre: metres and radians.
    step_error: [f64; 2],
    pub(super) largest_move_m: f64,
    r_near_before_m2: Option<f64>,
    r_near_m2: Option<f64>,
}

#[derive(Debug, Serialize)]
pub(super) struct DriftResult {
    pub(super) before: RunDrift,
    pub(super) after: RunDrift,
    comparison: Option<DriftComparison>,
}

#[derive(Debug, Serialize)]
pub(super) struct ScoreResult {
    pub(super) before: RunReport,
    pub(super) after: RunReport,
    pub(super) pair: Option<PairReport>,
}

impl RepairResult {
    pub(super) fn new(run: &Run, repair: &Repair) -> Self {
        let round = |round: &Round| RoundResult {
            pairs_found: round.pairs_found,
            pairs_measured: round.pairs_measured,
            constraints: round.constraints,
            consistent: round.consistent,
            accepted: round.accepted,
            step_error: [round.step_error.place_m, round.step_error.turn_rad],
            largest_move_m: round.largest_move_m,
            r_near_before_m2: repair.r_near_before_m2,
            r_near_m2: round.r_near_m2,
        };
        Self {
            schema: "dmp-repair/1",
            dmp_version: env!("CARGO_PKG_VERSION"),
            run: run.name.clone(),
            outcome: in_words(repair.outcome),
            is_written: repair.trajectory.is_some(),
            rounds: repair.rounds.iter().map(round).collect(),
            drift: None,
            score: None,
        }
    }

    /// With both runs measured and scored beside each other, the one before first.
    pub(super) fn compare(&mut self, drift: DriftReport, score: Report) {
        let comparison = drift.comparisons.into_iter().next();
        if let Ok([before, after]) = <[RunDrift; 2]>::try_from(drift.runs) {
            self.drift = Some(DriftResult { before, after, comparison });
        }
        let pair = score.pairs.into_iter().next();
        let is_worse = pair.as_ref().is_some_and(|pair| pair.verdict.ahead() == Some(&self.run));
        let mut runs = score.runs;
        runs.sort_by_key(|report| report.name != self.run);
        if let Ok([before, after]) = <[RunReport; 2]>::try_from(runs) {
            self.score = Some(ScoreResult { before, after, pair });
        }
        if is_worse {
            (self.outcome, self.is_written) = ("worse", false);
        }
    }
}

fn in_words(outcome: Outcome) -> &'static str {
    match outcome {
        Outcome::Repaired => "repaired",
        Outcome::NoRevisit => "no revisit",
        Outcome::NothingMeasured => "nothing measured",
        Outcome::NothingToRepair => "nothing to repair",
        Outcome::NothingAccepted => "nothing accepted",
        // Of later versions of the library.
        _ => "left as it is",
    }
}
