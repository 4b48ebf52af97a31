//! `dmp loops`: rank loop candidates of a pose graph.

mod inputs;
mod options;
mod outputs;
mod ranked;
mod render;
mod result;
mod weights;

use std::time::Instant;

use dmp::Config;
use dmp_log::Candidate;
use dmp_loops::{Keyframes, LoopError, LoopMap, Scorer, in_threads, optimised};
use dmp_sensor::PoseEdge;

use crate::console::{Common, Exit, Progress, Usage, say, when_printed};
use crate::options::{Asked, Out, Spec, graph as graph_options, input, output, scoring};
use inputs::Inputs;
use options::map_options;
use ranked::rank;
use result::LoopsResult;

pub(crate) static SPEC: Spec = Spec {
    name: "loops",
    about: "Rank loop candidates of a pose graph: true ones first, false ones last",
    more: "Adds each candidate alone to the graph, optimises the graph, and scores the map of the scans at the new poses by \
           `R_near(2 m)`, in a room `R_near(0.2 m)`. A true loop makes the map sharper, a false one doubles its walls. Needs no \
           ground truth. Without --log candidates are ranked by the growth of the graph's sum of squares.",
    usage: "dmp loops [OPTIONS] GRAPH.g2o --candidates FILE.g2o [--log LOG]",
    after: "Examples:\n  \
            dmp loops graph.g2o --candidates loops.g2o --log drive.mcap --keyframes times.txt\n  \
            dmp loops graph.g2o --candidates loops.g2o --log Scans/ --truth labels.csv --svg curve.svg\n  \
            dmp loops graph.g2o --candidates loops.g2o --log Scans/ --accept --save-graph better.g2o\n  \
            dmp loops graph.g2o --candidates loops.g2o --json > loops.json\n\n\
            Exit codes: 0 done; 1 failed; 2 wrong usage; 3 done, but candidates were skipped or part of the log was lost.",
    options: &[
        &[
            &graph_options::GRAPH,
            &graph_options::CANDIDATES,
            &graph_options::LOG_OF_GRAPH,
            &input::KEYFRAMES,
            &input::TIME_UNIT,
            &graph_options::LABELS,
        ],
        input::READING,
        &[&input::EVERY, &input::EXTRINSIC, &input::MAX_TIME_GAP],
        scoring::RANGES,
        &[
            &scoring::VOXEL,
            &input::LOG_OFFSET,
            &graph_options::STEP_ERROR,
            &graph_options::LOOP_ERROR,
            &graph_options::LOOP_KERNEL,
            &graph_options::ACCEPT,
        ],
        &[&graph_options::RAYS, &graph_options::MOVED, &graph_options::DIRECT],
        scoring::MEANS,
        &[
            &output::JSON,
            &graph_options::CURVE,
            &graph_options::ACCEPTED_GRAPH,
            &graph_options::ACCEPTED_POSES,
        ],
    ],
    run,
    ..Spec::EMPTY
};

fn run(asked: &Asked, common: &Common, out: &mut Out<'_>) -> anyhow::Result<Exit> {
    let config = asked.config();
    config.check()?;
    map_options(asked).check().map_err(in_words)?;
    let start = Instant::now();
    let inputs = Inputs::read(asked, &config, common)?;
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
            let body_from_sensor = inputs::body_from_sensor(asked, run.trajectory, log.as_ref(), common)?;
            Some((log.as_ref(), keyframes, Config { body_from_sensor, ..config.clone() }))
        }
    };
    let map = match &seen {
        Some((log, keyframes, config)) if !asked.has(&graph_options::DIRECT) => {
            let options = map_options(asked);
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
    let work =
        || rank(graph, &inputs.options, scorer, &candidates, asked.has(&graph_options::ACCEPT), &progress);
    let ranked = in_threads(config.threads, work).and_then(|ranked| ranked).map_err(in_words)?;
    drop(progress);

    let result = LoopsResult::new((asked, &config), &inputs, &found, map.as_ref(), &ranked, read_s, start);
    let written =
        outputs::write(asked, &result, &inputs, &ranked, seen.as_ref().map(|(_, keyframes, _)| keyframes));
    let printed = if asked.has(&output::JSON) {
        say::json(out, &result).map_err(Into::into)
    } else {
        render::result(out, &result)
    };
    written?;
    when_printed(printed, result.exit())
}

/// An error under the type that decides on the exit code.
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
