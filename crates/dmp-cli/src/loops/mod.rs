//! `dmp loops`: rank loop candidates of a pose graph.

mod args;
mod inputs;
mod outputs;
mod ranked;
mod render;
mod result;
mod weights;

use std::io::Write;
use std::time::Instant;

use dmp::Config;
use dmp_log::Candidate;
use dmp_loops::{Keyframes, LoopError, LoopMap, Scorer, in_threads, optimised};
use dmp_sensor::PoseEdge;

use crate::common::Common;
use crate::exit::{Exit, Usage, when_printed};
use crate::progress::Progress;
pub(crate) use args::LoopsArgs;
use inputs::Inputs;
use ranked::rank;
use result::LoopsResult;

pub(crate) fn run(arguments: &LoopsArgs, common: &Common, out: &mut impl Write) -> anyhow::Result<Exit> {
    let config = arguments.config();
    config.check()?;
    arguments.map_options().check().map_err(in_words)?;
    let start = Instant::now();
    let inputs = Inputs::read(arguments, common)?;
    let progress = Progress::new(common);
    let candidates: Vec<PoseEdge> =
        inputs.candidates.iter().map(|one: &Candidate| one.edge.clone()).collect();
    let (graph, found) = optimised(&inputs.graph, &inputs.options).map_err(in_words)?;

    let seen = match &inputs.log {
        None => None,
        Some(log) => {
            let keyframes =
                Keyframes::of(&graph, inputs.stamps_ns.as_deref(), log.as_ref(), config.time_offset_ns)
                    .map_err(in_words)?;
            let run = keyframes.run("graph", graph.poses()).map_err(in_words)?;
            let body_from_sensor = inputs::body_from_sensor(arguments, run.trajectory, log.as_ref(), common)?;
            Some((log.as_ref(), keyframes, Config { body_from_sensor, ..config.clone() }))
        }
    };
    let map = match &seen {
        Some((log, keyframes, config)) if !arguments.direct => {
            let options = arguments.map_options();
            Some(LoopMap::new(*log, keyframes, graph.poses(), config, options, &progress).map_err(in_words)?)
        }
        _ => None,
    };
    let read_s = start.elapsed().as_secs_f64();
    let scorer = match (&map, &seen) {
        (Some(map), _) => Scorer::patches(map),
        (None, Some((log, keyframes, config))) => Scorer::log(*log, keyframes, config),
        (None, None) => Scorer::graph(),
    };
    let work = || rank(graph, &inputs.options, scorer, &candidates, arguments.accept, &progress);
    let ranked = in_threads(config.threads, work).and_then(|ranked| ranked).map_err(in_words)?;
    drop(progress);

    let result = LoopsResult::new(arguments, &inputs, &found, map.as_ref(), &ranked, read_s, start);
    let written =
        arguments.output.write(&result, &inputs, &ranked, seen.as_ref().map(|(_, keyframes, _)| keyframes));
    let printed = if arguments.output.json { result.print_json(out) } else { render::result(out, &result) };
    written?;
    when_printed(printed, result.exit())
}

/// What is wrong with the command line or with the data comes under the name that exit codes are found by.
pub(crate) fn in_words(error: LoopError) -> anyhow::Error {
    match error {
        LoopError::Evaluate(error) => error.into(),
        error @ (LoopError::Setting { .. }
        | LoopError::WhichScans { .. }
        | LoopError::OtherCount { .. }
        | LoopError::NoStamps) => Usage(error.to_string()).into(),
        error => error.into(),
    }
}
