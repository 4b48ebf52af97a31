//! `dmp repair`: repair a run using its own loop closures.

mod render;
mod result;

use dmp::{Config, DriftPairs, MapSource, Run, evaluate, measure_drift};
use dmp_log::write_pose_graph;
use dmp_loops::{RepairOptions, repair};

use super::loops::in_words;
use crate::console::{Common, Exit, Progress, say, when_printed};
use crate::files::{SavedTogether, write_trajectory};
use crate::inputs::{LogInput, OpenedRuns, Runs, vetting};
use crate::options::{Asked, Out, Spec, graph, input, output, scoring};
use result::RepairResult;

pub(crate) static SPEC: Spec = Spec {
    name: "repair",
    about: "Repair a run using its own loop closures",
    more: "Registers visits to the same places, as `dmp drift` does. The results become loops of a pose graph of the run. Loops \
           that agree with each other and do not make the map worse are accepted, as by `dmp loops --accept`, and all poses \
           are adjusted smoothly. Both runs are then measured and scored. Nothing is written if the run has no revisit, is \
           within measurement error, or would not get better; a message says why.",
    usage: "dmp repair [OPTIONS] LOG -t [NAME=]RUN.tum -o REPAIRED.tum",
    after: "Examples:\n  \
            dmp repair drive.mcap -t run.tum -o repaired.tum\n  \
            dmp repair drive.mcap -t kiss=kiss_poses.npy --pose-at kiss=end -o repaired.tum --save-graph repaired.g2o\n  \
            dmp repair city.mcap -t run.tum --pairs 100 -o repaired.tum --json > repair.json\n\n\
            Exit codes: 0 done, also if there was nothing to repair; 1 failed; 2 wrong usage; 3 done, but part of the log was \
            lost or damaged.",
    options: &[
        input::RUN_ON_LOG,
        scoring::RANGES,
        input::CHECKS,
        &[&graph::PAIRS, &graph::ROUNDS],
        scoring::MEANS,
        &[&graph::REPAIRED, &graph::REPAIRED_GRAPH, &output::JSON],
    ],
    run,
    ..Spec::EMPTY
};

fn run(asked: &Asked, common: &Common, out: &mut Out<'_>) -> anyhow::Result<Exit> {
    let started = Runs::start(asked)?;
    let repaired_to = asked.need(&graph::REPAIRED)?;
    let config = asked.config();
    config.check()?;
    let usual = RepairOptions::default();
    let options = RepairOptions {
        pairs: asked.get(&graph::PAIRS).unwrap_or(DriftPairs::All),
        most_rounds: asked.get(&graph::ROUNDS).unwrap_or(usual.most_rounds),
        ..usual
    };
    let log = LogInput::of(asked)?;
    let opened = OpenedRuns::open(started, [MapSource::Fused], &log, asked, config.threads, common)?;
    let (opened, _) = vetting::checked(opened, &log, asked, &config, common)?;
    let OpenedRuns { log, runs, damaged, .. } = opened;
    let scales = config.scales_on(log.summary());
    let Some(run) = runs.first() else { anyhow::bail!("there is no run to repair") };

    let watch = Progress::new(common);
    let repaired = repair(log.as_ref(), run, &config, &options, &watch).map_err(in_words)?;
    let mut result = RepairResult::new(run, &repaired);
    if let Some(trajectory) = &repaired.trajectory {
        let name = format!("{}-repaired", run.name);
        let both = [run.clone(), Run { name, trajectory: trajectory.clone(), ..run.clone() }];
        let measuring = Config { drift: options.pairs, ..config.clone() };
        let drift = measure_drift(log.as_ref(), &both, &measuring, &watch)?;
        let scoring = Config { drift: DriftPairs::None, ..config };
        let score = evaluate(log.as_ref(), &both, &scoring, &watch)?;
        result.compare(drift, score);
    }
    drop(watch);
    let recording = scales.lengths().recording;
    if let (true, Some(trajectory), Some(graph)) = (result.is_written, &repaired.trajectory, &repaired.graph)
    {
        let mut files = SavedTogether::default();
        files.add(&repaired_to, |out| write_trajectory(out, trajectory))?;
        if let Some(path) = asked.get(&graph::REPAIRED_GRAPH) {
            files.add(&path, |out| write_pose_graph(out, graph))?;
        }
        files.commit()?;
    }
    let printed = if asked.has(&output::JSON) {
        say::json(out, &result)
    } else {
        render::result(out, &result, recording, &repaired_to)
    };
    when_printed(printed.map_err(Into::into), if damaged { Exit::InputDamaged } else { Exit::Done })
}
