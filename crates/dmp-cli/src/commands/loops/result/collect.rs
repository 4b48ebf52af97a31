//! The result of what was read and found.

use std::collections::BTreeMap;
use std::time::Instant;

use dmp::{Config, ScaleScores, Scales};
use dmp_log::{CandidateFault, shown_path};
use dmp_loops::{Decision, Estimate, LoopMap, MapScores, Optimised, Tried, Verdict};
use dmp_sensor::DropReason;
use dmp_truth::detection::{PrecisionRecall, Ranked as Labelled};

use super::{
    AcceptedResult, CandidateResult, ConfigResult, CurveResult, DecisionResult, InputsResult, LogResult,
    LoopsResult, MemoryResult, PatchesResult, SCHEMA, SkippedResult, TimingResult, TruthResult,
    WithoutResult,
};
use crate::commands::loops::inputs::Inputs;
use crate::commands::loops::options::map_options;
use crate::commands::loops::ranked::Ranked;
use crate::options::{Asked, graph};

impl LoopsResult {
    pub(crate) fn new(
        (asked, config): (&Asked, &Config),
        inputs: &Inputs,
        found: &Optimised,
        map: Option<&LoopMap>,
        ranked: &Ranked,
        read_s: f64,
        start: Instant,
    ) -> Self {
        let pair = |error: Option<(f64, f64)>| error.map(|(metres, radians)| [metres, radians]);
        let (truth, truth_withheld) = truth_of(inputs, ranked);
        let candidates: Vec<_> =
            ranked.ranking.ranked.iter().map(|tried| candidate_of(inputs, tried)).collect();
        Self {
            schema: SCHEMA,
            dmp_version: env!("CARGO_PKG_VERSION"),
            config: ConfigResult {
                ranked_by: match (&inputs.log, asked.has(&graph::DIRECT)) {
                    (None, _) => "graph",
                    (Some(_), true) => "map-direct",
                    (Some(_), false) => "map",
                },
                voxel_m: map.map(LoopMap::voxel_m),
                rays_per_keyframe: map.map(|_| map_options(asked).rays_per_keyframe),
                scale_m: inputs.log.as_ref().map(|log| scale_m(config.scales_on(log.summary()))),
                moved_m: map.map(LoopMap::moved_m),
                step_error: pair(inputs.weights.step_error),
                loop_error: pair(inputs.weights.loop_error),
                loop_kernel: inputs.weights.kernel.map(|kernel| format!("{kernel:?}")),
            },
            inputs: InputsResult {
                graph: asked.get(&graph::GRAPH).map(|path| shown_path(&path)).unwrap_or_default(),
                vertices: inputs.graph.ids().len(),
                edges: inputs.graph.edges().len(),
                candidates: asked.get(&graph::CANDIDATES).map(|path| shown_path(&path)).unwrap_or_default(),
                log: inputs.log.as_ref().map(|log| LogResult {
                    path: shown_path(&log.summary().path),
                    scans: map.map_or(log.frames().len(), LoopMap::scans),
                    patches: map.map(patches_of),
                    damage: log
                        .summary()
                        .damage
                        .iter()
                        .map(|lost| format!("{}: {}", lost.place, lost.what))
                        .collect(),
                }),
            },
            without: WithoutResult {
                chi2_before: found.chi2_before,
                chi2: ranked.without.chi2,
                iterations: found.iterations,
                r_near_m2: ranked.without.map.as_ref().map(near_of),
            },
            candidates,
            skipped: skipped_of(inputs, ranked),
            accepted: ranked.accepted.as_ref().map(|accepted| accepted_of(inputs, ranked, accepted)),
            truth,
            truth_withheld,
            timing: TimingResult {
                read_s,
                rank_s: ranked.rank_s,
                accept_s: ranked.accept_s,
                total_s: start.elapsed().as_secs_f64(),
                threads: config.threads,
            },
            memory: MemoryResult {
                budget_bytes: config.memory_bytes,
                peak_anon_bytes: dmp::peak_anonymous_bytes(),
            },
        }
    }
}

fn patches_of(map: &LoopMap) -> PatchesResult {
    PatchesResult {
        returns_used: map.counts().used(),
        returns_dropped: dropped(map),
        keyframes_with_scans: map.keyframes_seen(),
        rays: map.rays(),
        file_bytes: map.patch_bytes(),
    }
}

fn dropped(map: &LoopMap) -> BTreeMap<&'static str, u64> {
    let counts = DropReason::ALL.into_iter().map(|reason| (reason.name(), map.counts().dropped(reason)));
    counts.filter(|(_, count)| *count > 0).collect()
}

fn near_of(map: &MapScores) -> ScaleScores {
    ScaleScores::new(map.r_near_m2.map(|(scale_m, score)| (scale_m, score.map(|score| score.value_m2))))
}

/// The truncation of `R_near` that ranks loops, metres.
fn scale_m(scales: Scales) -> f64 {
    scales.lengths().near_m[1]
}

/// A change and its interval.
fn change_of(map: Option<&MapScores>) -> (Option<f64>, Option<[f64; 2]>) {
    let change: Option<Estimate> = map.and_then(|map| map.change);
    let interval = change.and_then(|change| change.interval);
    (change.map(|change| change.value_m2), interval.map(|interval| [interval.low_m2, interval.high_m2]))
}

fn candidate_of(inputs: &Inputs, tried: &Tried) -> CandidateResult {
    let candidate = &inputs.candidates[tried.index];
    let (change_m2, change_ci99_m2) = change_of(tried.map.as_ref());
    CandidateResult {
        place: candidate.place.to_string(),
        from: candidate.edge.from,
        to: candidate.edge.to,
        r_near_m2: tried.map.as_ref().map(near_of),
        change_m2,
        change_ci99_m2,
        largest_move_m: tried.largest_move_m,
        moved_most: tried.moved_most,
        largest_turn_rad: tried.largest_turn_rad,
        chi2_change: tried.chi2_change,
        own_chi2: tried.own_chi2,
        iterations: tried.iterations,
        cast_share: tried.map.as_ref().map(|map| map.cast_share),
        label: inputs.label(tried.index),
    }
}

/// Those that could not be read as candidates, and those that have no score.
fn skipped_of(inputs: &Inputs, ranked: &Ranked) -> Vec<SkippedResult> {
    let read = inputs.skipped.iter().map(|skipped| SkippedResult {
        place: skipped.place.to_string(),
        from: skipped.ends.map(|ends| ends.0),
        to: skipped.ends.map(|ends| ends.1),
        why: skipped.fault.to_string(),
    });
    let tried = ranked.ranking.failed.iter().map(|failed| {
        let candidate = &inputs.candidates[failed.index];
        SkippedResult {
            place: candidate.place.to_string(),
            from: Some(candidate.edge.from),
            to: Some(candidate.edge.to),
            why: failed.fault.to_string(),
        }
    });
    read.chain(tried).collect()
}

fn accepted_of(inputs: &Inputs, ranked: &Ranked, accepted: &dmp_loops::Acceptance) -> AcceptedResult {
    let decision = |decision: &Decision| {
        let edge = &inputs.candidates[decision.index].edge;
        let (change_m2, change_ci99_m2) =
            change_of(decision.tried.as_ref().and_then(|tried| tried.map.as_ref()));
        DecisionResult {
            from: edge.from,
            to: edge.to,
            accepted: matches!(decision.verdict, Verdict::Accepted),
            why_not: match &decision.verdict {
                Verdict::Accepted => None,
                Verdict::Worse => Some("may be worse".to_owned()),
                Verdict::Failed(fault) => Some(fault.to_string()),
            },
            after: decision.after,
            change_m2,
            change_ci99_m2,
            label: inputs.label(decision.index),
        }
    };
    let decisions: Vec<DecisionResult> = accepted.decisions.iter().map(decision).collect();
    let count = |accepted: Option<bool>, label: bool| {
        let those =
            decisions.iter().filter(|d| accepted.is_none_or(|a| d.accepted == a) && d.label == Some(label));
        those.count() as f64
    };
    let share = |part: f64, of: f64| (of > 0.0).then(|| part / of);
    let right = count(Some(true), true);
    let missed = labels_without_score(inputs, ranked).filter(|label| *label == Some(true)).count() as f64;
    AcceptedResult {
        accepted: decisions.iter().filter(|decision| decision.accepted).count(),
        failed: accepted.decisions.iter().filter(|one| matches!(one.verdict, Verdict::Failed(_))).count(),
        r_near_m2: accepted.r_near_m2,
        chi2: accepted.chi2,
        precision: share(right, right + count(Some(true), false)),
        recall: share(right, count(None, true) + missed),
        decisions,
    }
}

/// The labels of candidates that could not be read as such or have no score: they are never accepted, and a true one among
/// them is missed. A pair that an earlier candidate has already counts there.
fn labels_without_score(inputs: &Inputs, ranked: &Ranked) -> impl Iterator<Item = Option<bool>> {
    let failed = ranked.ranking.failed.iter().map(|failed| inputs.label(failed.index));
    let skipped = inputs.skipped.iter().filter(|one| !matches!(one.fault, CandidateFault::Repeated { .. }));
    let label = |(from, to)| inputs.labels.as_ref()?.of(from, to);
    failed.chain(skipped.map(move |one| one.ends.and_then(label)))
}

/// Precision and recall of the ranking, or why there are none.
fn truth_of(inputs: &Inputs, ranked: &Ranked) -> (Option<TruthResult>, Option<String>) {
    if inputs.labels.is_none() {
        return (None, None);
    }
    let ranking = &ranked.ranking;
    let scored = ranking.ranked.iter().map(|tried| (Some(tried.score()), inputs.label(tried.index)));
    let all = scored.chain(labels_without_score(inputs, ranked).map(|label| (None, label)));
    let labelled: Vec<Labelled> =
        all.filter_map(|(score, label)| Some(Labelled { score, is_true: label? })).collect();
    let found = match PrecisionRecall::of(&labelled) {
        Ok(found) => found,
        Err(error) => return (None, Some(error.to_string())),
    };
    let true_candidates = labelled.iter().filter(|one| one.is_true).count();
    let point = |point: &dmp_truth::detection::PrecisionRecallPoint| CurveResult {
        score: point.score,
        recall: point.recall,
        precision: point.precision,
    };
    let truth = TruthResult {
        average_precision: found.average_precision,
        true_candidates,
        false_candidates: labelled.len() - true_candidates,
        unlabelled: ranking.ranked.iter().filter(|tried| inputs.label(tried.index).is_none()).count(),
        recall_without_false: found.recall_without_false(),
        curve: found.points.iter().map(point).collect(),
    };
    (Some(truth), None)
}
