//! The options of `dmp loops`.

use std::path::{Path, PathBuf};

use clap::Args;
use dmp::Config;
use dmp_log::{ScanLog, TimeUnit};
use dmp_loops::MapOptions;

use super::weights::WeightArgs;
use crate::log_args::{ReadingArgs, in_threads};
use crate::parse;
use crate::settings::{ResourceArgs, ScanArgs};

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
    pub(super) graph: PathBuf,
    /// The loop candidates: `EDGE_SE3:QUAT` lines between vertices of the graph
    #[arg(long, value_name = "FILE.g2o", help_heading = "Input")]
    pub(super) candidates: PathBuf,
    /// The log with the scans: FILE.mcap or a rosbag2 folder or .db3 with PointCloud2 or Livox CustomMsg, or a folder of
    /// scans (.bin, .pcd, .ply, .las, .laz)
    #[arg(long, value_name = "LOG", help_heading = "Input")]
    pub(super) log: Option<PathBuf>,
    /// When the keyframes were: a line for each vertex, `ID SECONDS`, or `SECONDS` alone in the order of the ids, or
    /// their poses in TUM format. Without it the n-th scan of the log is the n-th vertex
    #[arg(long, value_name = "TIMES", help_heading = "Input")]
    pub(super) keyframes: Option<PathBuf>,
    /// The unit of the stamps of --keyframes, where it is not seconds or is asked for: s, ms, us or ns
    #[arg(long, value_name = "UNIT", requires = "keyframes", help_heading = "Input")]
    pub(super) time_unit: Option<TimeUnit>,
    /// Which candidates are true, where somebody knows: lines `FROM,TO,true` or `FROM,TO,false`. Gives precision, recall
    /// and average precision
    #[arg(long, value_name = "LABELS", help_heading = "Input")]
    pub(super) truth: Option<PathBuf>,
    #[command(flatten)]
    pub(super) reading: ReadingArgs,
    #[command(flatten)]
    pub(super) scans: ScanArgs,
    /// Added to every stamp of the log before poses are looked up, seconds
    #[arg(long, value_name = "SECONDS", default_value = "0", value_parser = crate::score::parse::seconds_ns)]
    #[arg(allow_hyphen_values = true, help_heading = "Place and time")]
    time_offset: i64,
    #[command(flatten)]
    pub(super) weights: WeightArgs,

    /// Then add candidates from best to worst, and keep each that by the 99 % interval of its change makes the score worse
    /// by a tenth at most
    #[arg(long, help_heading = "Acceptance")]
    pub(super) accept: bool,

    /// Rays of each keyframe that are cast into each map; of more than a million in all each keyframe has fewer
    #[arg(long, value_name = "N", default_value_t = MapOptions::default().rays_per_keyframe)]
    #[arg(requires = "log", conflicts_with = "direct", help_heading = "Speed")]
    pub(super) rays: usize,
    /// A place where nothing moved further than this keeps its score, metres; 0 casts everything anew [default: 0.02, in
    /// a room 0.002]
    #[arg(long, value_name = "METRES")]
    #[arg(value_parser = parse::length_m, allow_hyphen_values = true)]
    #[arg(requires = "log", conflicts_with = "direct", help_heading = "Speed")]
    pub(super) moved: Option<f64>,
    /// Read the log again for each candidate, fuse its map from all returns and cast all of them: slow, and what
    /// everything else is measured against
    #[arg(long, requires = "log", conflicts_with = "accept", help_heading = "Speed")]
    pub(super) direct: bool,
    #[command(flatten)]
    pub(super) resources: ResourceArgs,

    #[command(flatten)]
    pub(super) output: OutputArgs,
}

impl LoopsArgs {
    pub(super) fn config(&self) -> Config {
        let config = self.scans.in_config(self.resources.in_config(Config::default()));
        Config { time_offset_ns: self.time_offset, ..config }
    }

    /// Opens a log.
    pub(super) fn open(&self, log: &Path) -> anyhow::Result<Box<dyn ScanLog>> {
        let mapper = self.scans.place.mapper(self.time_offset)?;
        Ok(in_threads(self.config().threads, || self.reading.open(log, &mapper))??)
    }

    pub(super) fn map_options(&self) -> MapOptions {
        MapOptions { rays_per_keyframe: self.rays, moved_m: self.moved }
    }
}

/// What is written, and how it is printed.
#[derive(Debug, Args)]
pub(super) struct OutputArgs {
    /// Print one JSON object (schema dmp-loops/1) instead of tables
    #[arg(long, help_heading = "Output")]
    pub(super) json: bool,
    /// The curve of precision over recall, as a picture; needs --truth
    #[arg(long, value_name = "FILE.svg", requires = "truth", help_heading = "Output")]
    pub(super) svg: Option<PathBuf>,
    /// The graph with the accepted loops, optimised, in g2o's format
    #[arg(long, value_name = "FILE.g2o", requires = "accept", help_heading = "Acceptance")]
    pub(super) save_graph: Option<PathBuf>,
    /// Its poses as a trajectory: TUM where keyframes have times, else KITTI rows
    #[arg(long, value_name = "FILE", requires = "accept", help_heading = "Acceptance")]
    pub(super) save_trajectory: Option<PathBuf>,
}
