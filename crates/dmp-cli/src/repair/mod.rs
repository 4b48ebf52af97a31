//! `dmp repair`: a run mended by what it sees itself where it comes back.

mod args;
mod render;
mod result;

use std::io::{self, Write};

use dmp::{Config, DriftPairs, MapSource, Run, evaluate, measure_drift};
use dmp_log::write_pose_graph;
use dmp_loops::repair;

use crate::common::Common;
use crate::exit::{Exit, when_printed};
use crate::loops::in_words;
use crate::progress::Progress;
use crate::runs::{OpenedRuns, Runs};
use crate::save::{SavedTogether, write_trajectory};
pub(crate) use args::RepairArgs;
use result::RepairResult;

pub(crate) fn run(arguments: &RepairArgs, common: &Common, out: &mut impl Write) -> anyhow::Result<Exit> {
    let started = Runs::start(std::slice::from_ref(&arguments.trajectory), &arguments.reading)?;
    let time_offset_ns = arguments.clock.offset_of_all_ns();
    let config = Config { time_offset_ns, ..arguments.resources.in_config(Config::default()) };
    let config = arguments.place.in_config(config);
    config.check()?;
    let options = arguments.options();
    let poses = (&arguments.place, &arguments.clock);
    let opened =
        OpenedRuns::open(started, [MapSource::Fused], &arguments.log, poses, config.threads, common)?;
    let (opened, _) = arguments.conventions.vet(opened, &arguments.log, poses, &config, common)?;
    let OpenedRuns { log, runs, damaged } = opened;
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
        files.add(&arguments.output, |out| write_trajectory(out, trajectory))?;
        if let Some(path) = &arguments.save_graph {
            files.add(path, |out| write_pose_graph(out, graph))?;
        }
        files.commit()?;
    }
    let printed = if arguments.json {
        let written = serde_json::to_writer_pretty(&mut *out, &result).map_err(io::Error::from);
        written.and_then(|()| writeln!(out))
    } else {
        render::result(out, &result, recording, &arguments.output)
    };
    when_printed(printed.map_err(Into::into), if damaged { Exit::InputDamaged } else { Exit::Done })
}
