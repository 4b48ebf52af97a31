//! `dmp loops`: rank loop candidates of a pose graph.

mod inputs;
mod outputs;
mod render;
mod result;
mod weights;

use std::io::Write;
use std::path::PathBuf;
use std::time::Instant;

use clap::Args;
use dmp::Config;
use dmp_log::{Candidate, ScanLog};
use dmp_loops::{
    Keyframes, LoopError, LoopMap, MapOptions, OptimiseOptions, Ranker, Ranking, Scorer, in_threads,
    optimised,
};
use dmp_sensor::{PoseEdge, PoseGraph};

use crate::exit::Usage;
use crate::log_args::ReadingArgs;
use crate::progress::Progress;
use crate::settings::{ResourceArgs, ScanArgs};
use crate::{Common, Exit, parse, when_printed};
use inputs::Inputs;
use outputs::OutputArgs;
use result::LoopsResult;
use weights::WeightArgs;

/// Rank loop candidates of a pose graph: the true ones first, the false ones last
///
/// Each candidate is added to the graph by itself, the graph is optimised, and the map that the scans make at the
/// new poses is scored by `R_near(2 m)`, in a room `R_near(0.2 m)`: how far measured ranges are from what the map predicts. A true loop makes the
/// map sharper, a false one doubles its walls. No ground truth is needed. Without --log the graph alone is asked: how
/// much its sum of squares grows.
#[derive(Debug, Args)]
#[command(
    override_usage = "dmp loops [OPTIONS] GRAPH.g2o --candidates FILE.g2o [--log LOG]",
    after_help = "Examples:\n  \
    dmp loops graph.g2o --candidates loops.g2o --log drive.mcap --keyframes times.txt\n  \
    dmp loops graph.g2o --candidates loops.g2o --log Scans/ --truth labels.csv --svg curve.svg\n  \
    dmp loops graph.g2o --candidates loops.g2o --log Scans/ --accept --save-graph better.g2o --save-trajectory better.tum\n  \
    dmp loops graph.g2o --candidates loops.g2o --json > loops.json\n\n\
    Exit codes: 0 done; 1 failed; 2 wrong usage; 3 done, but candidates were skipped or part of the log was lost."
)]
pub(crate) struct LoopsArgs {
    /// The graph without the candidates, in g2o's text format: `VERTEX_SE3:QUAT`, a keyframe each, and `EDGE_SE3:QUAT`
    #[arg(value_name = "GRAPH.g2o")]
    graph: PathBuf,
    /// The loop candidates: `EDGE_SE3:QUAT` lines between vertices of the graph
    #[arg(long, value_name = "FILE.g2o", help_heading = "Input")]
    candidates: PathBuf,
    /// The log with the scans: FILE.mcap or a rosbag2 folder or .db3 with PointCloud2 or Livox CustomMsg, or a folder of
    /// scans (.bin, .pcd, .ply, .las, .laz)
    #[arg(long, value_name = "LOG", help_heading = "Input")]
    log: Option<PathBuf>,
    /// When the keyframes were: a line for each vertex, `ID SECONDS`, or `SECONDS` alone in the order of the ids, or
    /// their poses in TUM format. Without it the n-th scan of the log is the n-th vertex
    #[arg(long, value_name = "TIMES", help_heading = "Input")]
    keyframes: Option<PathBuf>,
    /// Which candidates are true, where somebody knows: lines `FROM,TO,true` or `FROM,TO,false`. Gives precision, recall
    /// and average precision
    #[arg(long, value_name = "LABELS", help_heading = "Input")]
    truth: Option<PathBuf>,
    #[command(flatten)]
    reading: ReadingArgs,
    #[command(flatten)]
    scans: ScanArgs,
    #[command(flatten)]
    weights: WeightArgs,

    /// Then add candidates from best to worst, and keep each that by the 99 % interval of its change makes the score worse
    /// by a tenth at most
    #[arg(long, help_heading = "Acceptance")]
    accept: bool,

    /// Rays of each keyframe that are cast into each map; of more than a million in all each keyframe has fewer
    #[arg(long, value_name = "N", default_value_t = MapOptions::default().rays_per_keyframe)]
    #[arg(requires = "log", conflicts_with = "direct", help_heading = "Speed")]
    rays: usize,
    /// A place where nothing moved further than this keeps its score, metres; 0 casts everything anew [default: 0.02, in
    /// a room 0.002]
    #[arg(long, value_name = "METRES")]
    #[arg(value_parser = parse::length_m, allow_hyphen_values = true)]
    #[arg(requires = "log", conflicts_with = "direct", help_heading = "Speed")]
    moved: Option<f64>,
    /// Read the log again for each candidate, fuse its map from all returns and cast all of them: slow, and what
    /// everything else is measured against
    #[arg(long, requires = "log", conflicts_with = "accept", help_heading = "Speed")]
    direct: bool,
    #[command(flatten)]
    resources: ResourceArgs,

    #[command(flatten)]
    output: OutputArgs,
}

impl LoopsArgs {
    fn config(&self) -> Config {
        self.scans.in_config(self.resources.in_config(Config::default()))
    }

    fn map_options(&self) -> MapOptions {
        MapOptions { rays_per_keyframe: self.rays, moved_m: self.moved }
    }
}

pub(crate) fn run(arguments: &LoopsArgs, common: &Common, out: &mut impl Write) -> anyhow::Result<Exit> {
    let config = arguments.config();
    config.check()?;
    arguments.map_options().check().map_err(in_words)?;
    arguments.output.check(&arguments.inputs())?;
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

/// What was found.
struct Ranked {
    without: dmp_loops::Without,
    ranking: Ranking,
    accepted: Option<dmp_loops::Acceptance>,
    rank_s: f64,
    accept_s: f64,
}

fn rank(
    graph: PoseGraph,
    options: &OptimiseOptions,
    scorer: Scorer<'_>,
    candidates: &[PoseEdge],
    accept: bool,
    progress: &dyn dmp::Progress,
) -> Result<Ranked, LoopError> {
    let start = Instant::now();
    let ranker = Ranker::new(graph, options.clone(), scorer, progress)?;
    let without = ranker.without().clone();
    let ranking = ranker.rank(candidates, progress)?;
    let rank_s = start.elapsed().as_secs_f64();
    let accepted = if accept { Some(ranker.accept(candidates, &ranking, progress)?) } else { None };
    let accept_s = start.elapsed().as_secs_f64() - rank_s;
    Ok(Ranked { without, ranking, accepted, rank_s, accept_s })
}

/// What is wrong with the command line or with the data comes under the name that exit codes are found by.
fn in_words(error: LoopError) -> anyhow::Error {
    match error {
        LoopError::Evaluate(error) => error.into(),
        error @ (LoopError::Setting { .. }
        | LoopError::WhichScans { .. }
        | LoopError::OtherCount { .. }
        | LoopError::NoStamps) => Usage(error.to_string()).into(),
        error => error.into(),
    }
}

impl LoopsArgs {
    /// Every file that is read.
    fn inputs(&self) -> Vec<&std::path::Path> {
        let optional = [&self.log, &self.keyframes, &self.truth].into_iter().flatten();
        [&self.graph, &self.candidates].into_iter().chain(optional).map(PathBuf::as_path).collect()
    }
}

/// The log, opened.
type Log = Box<dyn ScanLog>;
