//! What is read before anything is computed.

use dmp_draw::text::{count, counted};
use dmp_log::{
    Candidate, KeyframeTimes, LoopLabels, PoseGraphFile, ScanLog, SkippedCandidate, StaticFrames,
    read_keyframe_times_in, read_loop_candidates, read_loop_labels, read_pose_graph,
};
use dmp_loops::OptimiseOptions;
use dmp_sensor::{Isometry3, PoseGraph, Trajectory};

use super::args::LoopsArgs;
use super::weights::Weights;
use crate::common::Common;
use crate::exit::Usage;
use crate::extrinsic;
use crate::loaded_run::LoadedRun;
use crate::log_args::LogHead;
use crate::say::say;
use crate::score::announce;

/// Most candidates that are skipped by name; the result has all.
const MOST_NAMED: usize = 10;
/// Kinds of lines that are named by themselves.
const MOST_KINDS: usize = 5;

pub(super) struct Inputs {
    /// With the weights that take effect.
    pub(super) graph: PoseGraph,
    pub(super) candidates: Vec<Candidate>,
    pub(super) skipped: Vec<SkippedCandidate>,
    pub(super) labels: Option<LoopLabels>,
    pub(super) stamps_ns: Option<Vec<i64>>,
    pub(super) weights: Weights,
    pub(super) options: OptimiseOptions,
    pub(super) log: Option<Box<dyn ScanLog>>,
}

impl Inputs {
    /// What is short comes first, so that a mistake in it is told before a long log is read.
    pub(super) fn read(arguments: &LoopsArgs, common: &Common) -> anyhow::Result<Self> {
        let note = |text: String| {
            if !common.quiet {
                say!(common.host, "note: {text}");
            }
        };
        let file = read_pose_graph(&arguments.graph)?;
        tell_others(&file, arguments, &note);
        file.graph
            .check_connected(&[])
            .map_err(|error| anyhow::anyhow!("{}: {error}", arguments.graph.display()))?;
        let weights = arguments.weights.of(file.has_information);
        if weights.is_guessed {
            let (step, of_loop) =
                (weights.step_error.unwrap_or_default(), weights.loop_error.unwrap_or_default());
            note(format!(
                "{}: its edges do not say how good they are; steps are taken to be good to {} m and {} rad, loops to {:.2} m and \
                 {:.2} rad, and candidates that do not say it either: --step-error and --loop-error say otherwise",
                arguments.graph.display(),
                step.0,
                step.1,
                of_loop.0,
                of_loop.1
            ));
        }
        // Where it is told how good loops are, candidates need not say it.
        let has_information = file.has_information && weights.loop_error.is_none();
        let read =
            read_loop_candidates(&arguments.candidates, &PoseGraphFile { has_information, ..file.clone() })?;
        let weigh =
            |one: Candidate| Candidate { edge: arguments.weights.of_candidate(&one.edge, &weights), ..one };
        let candidates: Vec<Candidate> = read.candidates.into_iter().map(weigh).collect();
        for skipped in read.skipped.iter().take(MOST_NAMED) {
            note(format!(
                "{}: {}: skipped: {}",
                arguments.candidates.display(),
                skipped.place,
                skipped.fault
            ));
        }
        if let more @ 1.. = read.skipped.len().saturating_sub(MOST_NAMED) {
            note(format!(
                "{}: {} more candidates are skipped",
                arguments.candidates.display(),
                count(more as u64)
            ));
        }
        if candidates.is_empty() {
            let all = counted(read.skipped.len() as u64, "candidate");
            anyhow::bail!("{}: none of {all} can be tried", arguments.candidates.display());
        }
        let labels = arguments.truth.as_deref().map(read_loop_labels).transpose()?;
        if let (Some(path), Some(labels)) = (&arguments.truth, &labels) {
            // No two candidates have one pair of vertices.
            let labelled = |one: &&Candidate| labels.of(one.edge.from, one.edge.to).is_some();
            let strange = labels.labels.len() - candidates.iter().filter(labelled).count();
            if strange > 0 {
                note(format!(
                    "{}: {} of no candidate that can be tried",
                    path.display(),
                    counted(strange as u64, "label")
                ));
            }
        }
        let stamps_ns = match &arguments.keyframes {
            None => None,
            Some(path) => {
                let times: KeyframeTimes = read_keyframe_times_in(path, arguments.time_unit)?;
                times.notes.iter().for_each(|told| note(format!("{}: {told}", path.display())));
                let of_vertices = times.of_vertices(file.graph.ids());
                Some(of_vertices.map_err(|fault| anyhow::anyhow!("{}: {fault}", path.display()))?)
            }
        };
        let options = OptimiseOptions { loop_kernel: weights.kernel, ..OptimiseOptions::default() };
        let log = match &arguments.log {
            None => None,
            Some(path) => Some(arguments.open(path)?),
        };
        let graph = weights.of_graph(&file.graph)?;
        Ok(Self { graph, candidates, skipped: read.skipped, labels, stamps_ns, weights, options, log })
    }

    /// The label of a candidate, where there is one.
    pub(super) fn label(&self, index: usize) -> Option<bool> {
        let edge = &self.candidates[index].edge;
        self.labels.as_ref()?.of(edge.from, edge.to)
    }
}

/// Where the sensor sits on the body whose poses the graph has; tells it and what the log is.
pub(super) fn body_from_sensor(
    arguments: &LoopsArgs,
    trajectory: Trajectory,
    log: &dyn ScanLog,
    common: &Common,
) -> anyhow::Result<Isometry3<f64>> {
    let run = LoadedRun {
        name: "graph".to_owned(),
        given: arguments.graph.display().to_string(),
        path: arguments.graph.clone(),
        format: "g2o",
        trajectory,
        out_of_order: 0,
        repeated: 0,
        body_frame: None,
        static_frames: StaticFrames::default(),
        notes: Vec::new(),
        damaged: false,
        fingerprint: String::new(),
        is_carried: false,
    };
    let (runs, head) = ([run], LogHead::of_log(log));
    if !common.quiet {
        announce::found(&common.host, head, &runs);
    }
    let found = extrinsic::of_runs(&arguments.scans.place.extrinsic, &runs, head)?;
    if !common.quiet {
        announce::extrinsics(&common.host, &runs, &found);
    }
    let first = found.into_iter().next().ok_or_else(|| Usage("no place of the sensor".to_owned()))?;
    Ok(first.transform)
}

fn tell_others(file: &PoseGraphFile, arguments: &LoopsArgs, note: &dyn Fn(String)) {
    let graph = arguments.graph.display();
    for (tag, count) in file.other_records.iter().take(MOST_KINDS) {
        note(format!("{graph}: {} `{tag}` passed over", counted(*count, "line")));
    }
    let more: u64 = file.other_records.values().skip(MOST_KINDS).sum();
    if more > 0 {
        let kinds = counted((file.other_records.len() - MOST_KINDS) as u64, "other kind");
        note(format!("{graph}: {} of {kinds} passed over", counted(more, "line")));
    }
    if file.repeated_vertices > 0 {
        note(format!("{graph}: {} left out", counted(file.repeated_vertices as u64, "repeated vertex line")));
    }
}
