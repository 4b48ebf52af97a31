//! What is read before anything is computed.

use std::path::Path;

use dmp::Config;
use dmp_draw::text::{count, counted};
use dmp_log::{
    Candidate, KeyframeTimes, LoopLabels, PoseGraphFile, ScanLog, SkippedCandidate, StaticFrames,
    read_keyframe_times_in, read_loop_candidates, read_loop_labels, read_pose_graph,
};
use dmp_loops::OptimiseOptions;
use dmp_sensor::{Isometry3, PoseGraph, Trajectory};

use super::weights::{GivenWeights, Weights};
use crate::console::{Common, Usage, say};
use crate::inputs::{LoadedRun, LogHead, LogInput, announce, extrinsic};
use crate::options::{Asked, graph, input};

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
    /// What is short comes first, so that a mistake in it is reported before a long log is read.
    pub(super) fn read(asked: &Asked, config: &Config, common: &Common) -> anyhow::Result<Self> {
        let (graph_path, candidates_path) = (asked.need(&graph::GRAPH)?, asked.need(&graph::CANDIDATES)?);
        let given = GivenWeights::of(asked);
        let note = |text: String| {
            if !common.quiet {
                say!(common.host, "note: {text}");
            }
        };
        let file = read_pose_graph(&graph_path)?;
        note_others(&file, &graph_path, &note);
        file.graph
            .check_connected(&[])
            .map_err(|error| anyhow::anyhow!("{}: {error}", graph_path.display()))?;
        let weights = given.weights(file.has_information);
        if weights.is_guessed {
            let (step, of_loop) =
                (weights.step_error.unwrap_or_default(), weights.loop_error.unwrap_or_default());
            note(format!(
                "{}: its edges have no information matrices; assumed standard deviations: steps {} m and {} rad, loops and \
                 candidates {:.2} m and {:.2} rad (--step-error, --loop-error)",
                graph_path.display(),
                step.0,
                step.1,
                of_loop.0,
                of_loop.1
            ));
        }
        // Where the error of loops is given, candidates need no information matrices.
        let has_information = file.has_information && weights.loop_error.is_none();
        let read =
            read_loop_candidates(&candidates_path, &PoseGraphFile { has_information, ..file.clone() })?;
        let weigh = |one: Candidate| Candidate { edge: given.of_candidate(&one.edge, &weights), ..one };
        let shown = candidates_path.display();
        let candidates: Vec<Candidate> = read.candidates.into_iter().map(weigh).collect();
        for skipped in read.skipped.iter().take(MOST_NAMED) {
            note(format!("{shown}: {}: skipped: {}", skipped.place, skipped.fault));
        }
        if let more @ 1.. = read.skipped.len().saturating_sub(MOST_NAMED) {
            note(format!("{shown}: {} more candidates are skipped", count(more as u64)));
        }
        if candidates.is_empty() {
            let all = counted(read.skipped.len() as u64, "candidate");
            anyhow::bail!("{shown}: none of {all} can be tried");
        }
        let truth = asked.get(&graph::LABELS);
        let labels = truth.as_deref().map(read_loop_labels).transpose()?;
        if let (Some(path), Some(labels)) = (&truth, &labels) {
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
        let stamps_ns = match asked.get(&input::KEYFRAMES) {
            None => None,
            Some(path) => {
                let times: KeyframeTimes = read_keyframe_times_in(&path, asked.get(&input::TIME_UNIT))?;
                times.notes.iter().for_each(|text| note(format!("{}: {text}", path.display())));
                let of_vertices = times.of_vertices(file.graph.ids());
                Some(of_vertices.map_err(|fault| anyhow::anyhow!("{}: {fault}", path.display()))?)
            }
        };
        let options = OptimiseOptions { loop_kernel: weights.kernel, ..OptimiseOptions::default() };
        let log = asked.get(&graph::LOG_OF_GRAPH).map(|path| LogInput::at(path, asked).open(config.threads));
        let log = log.transpose()?;
        let graph = weights.of_graph(&file.graph)?;
        Ok(Self { graph, candidates, skipped: read.skipped, labels, stamps_ns, weights, options, log })
    }

    /// The label of a candidate, where there is one.
    pub(super) fn label(&self, index: usize) -> Option<bool> {
        let edge = &self.candidates[index].edge;
        self.labels.as_ref()?.of(edge.from, edge.to)
    }
}

/// Where the sensor sits on the body whose poses the graph has; prints that, and what the log is.
pub(super) fn body_from_sensor(
    asked: &Asked,
    trajectory: Trajectory,
    log: &dyn ScanLog,
    common: &Common,
) -> anyhow::Result<Isometry3<f64>> {
    let path = asked.need(&graph::GRAPH)?;
    let run = LoadedRun {
        name: "graph".to_owned(),
        given: path.display().to_string(),
        path,
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
    let found = extrinsic::of_runs(asked, &runs, &[], head)?;
    if !common.quiet {
        announce::extrinsics(&common.host, &runs, &found);
    }
    let first = found.into_iter().next().ok_or_else(|| Usage("no place of the sensor".to_owned()))?;
    Ok(first.transform)
}

fn note_others(file: &PoseGraphFile, graph: &Path, note: &dyn Fn(String)) {
    let graph = graph.display();
    for (tag, count) in file.other_records.iter().take(MOST_KINDS) {
        note(format!("{graph}: {} `{tag}` ignored", counted(*count, "line")));
    }
    let more: u64 = file.other_records.values().skip(MOST_KINDS).sum();
    if more > 0 {
        let kinds = counted((file.other_records.len() - MOST_KINDS) as u64, "other kind");
        note(format!("{graph}: {} of {kinds} ignored", counted(more, "line")));
    }
    if file.repeated_vertices > 0 {
        note(format!("{graph}: {} ignored", counted(file.repeated_vertices as u64, "repeated vertex line")));
    }
}
