//! What is scored, and how: the arguments that `dmp score` and `dmp shard plan` have in common.

use std::path::{Path, PathBuf};

use clap::Args;
use dmp::{Config, DriftPairs};

use super::conventions::ConventionArgs;
use super::like::{Like, TAKEN};
use super::parse;
use super::promise::PromiseArgs;
use super::sampling::SamplingArgs;
use crate::drift::drift_pairs;
use crate::log_args::LogArgs;
use crate::named::NamedFile;
use crate::settings::SettingsArgs;
use crate::trajectory_args::TrajectoryArgs;

/// A log, runs on it, and everything that their scores depend on.
#[derive(Debug, Args)]
pub(crate) struct EvaluationArgs {
    /// A run to score: its trajectory, world_from_body in metres. A file (TUM, KITTI rows, EuRoC, .npy, g2o),
    /// `topic:/odom` of the log, or `BAG:/odom` of another bag (odometry, poses, a path; of frames,
    /// `topic:/tf:WORLD:BODY`). Called NAME, or like the file
    #[arg(short = 't', long = "trajectory", value_name = "[NAME=]RUN", help_heading = "Input")]
    #[arg(required_unless_present = "more")]
    pub(crate) trajectories: Vec<NamedFile>,
    #[command(flatten)]
    pub(crate) reading: TrajectoryArgs,
    /// A map to score against instead of the one fused from the scans: LAS, LAZ, PLY, PCD, a mesh in PLY or
    /// OBJ, or a saved map, in the world frame of the run NAME, or of all runs
    #[arg(long = "map", value_name = "[NAME=]FILE", help_heading = "Input")]
    pub(crate) maps: Vec<NamedFile>,
    /// The unit of the clouds and meshes given with --map: `auto` (what the file says, else metres), `m`, `ft`
    /// or `us-ft`
    #[arg(long, value_name = "UNIT", default_value = "auto", help_heading = "Input")]
    pub(crate) map_unit: parse::AutoUnit,
    #[command(flatten)]
    pub(crate) log: LogArgs,
    /// More runs: what a shell makes of `-t runs/*.tum`
    #[arg(value_name = "[NAME=]RUN", hide = true)]
    pub(crate) more: Vec<NamedFile>,
    #[command(flatten)]
    pub(crate) settings: SettingsArgs,
    /// Score as this result of `dmp score --keep` or `--json` of the same log was made, so that `dmp compare` takes both: with its
    /// voxel, segments, ranges, vehicle, every N-th scan, price of a miss, range noise, sampled scans and confidence
    #[arg(long, value_name = "RESULT", conflicts_with_all = TAKEN, help_heading = "Input")]
    pub(crate) like: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) conventions: ConventionArgs,
    #[command(flatten)]
    pub(crate) promise: PromiseArgs,
    #[command(flatten)]
    pub(crate) sampling: SamplingArgs,
    /// Measure drift in metres on so many pairs of visits to the same places at most, on `all`, or on `none`, as `dmp drift`
    /// does. Without this one for each two segments, and none where a sample is scored; `--drift` alone is all
    #[arg(long, value_name = "N", num_args = 0..=1, require_equals = true, default_missing_value = "all")]
    #[arg(value_parser = drift_pairs, conflicts_with = "quick", help_heading = "Returns and map")]
    pub(crate) drift: Option<DriftPairs>,
}

impl EvaluationArgs {
    pub(crate) fn config(&self) -> Config {
        let settings = Config { map_unit: self.map_unit.0, ..self.settings.config() };
        let config = self.promise.of(self.sampling.of(settings));
        Config { drift: self.drift.unwrap_or_default(), ..config }
    }

    /// The settings with those of the result to be like.
    pub(crate) fn like_in(&self, config: Config) -> anyhow::Result<(Config, Option<Like>)> {
        let like = self.like.as_deref().map(Like::read).transpose()?;
        let config = like.iter().try_fold(config, |config, like| like.settings(config))?;
        config.check()?;
        Ok((config, like))
    }

    /// The trajectories, as they were named.
    pub(crate) fn files(&self) -> Vec<NamedFile> {
        self.trajectories.iter().chain(&self.more).cloned().collect()
    }

    /// Every file that is read, as it was named.
    pub(crate) fn inputs(&self) -> Vec<&Path> {
        let named = self.trajectories.iter().chain(&self.more).chain(&self.maps);
        let named = named.map(|file| file.path.as_path()).chain(self.like.as_deref());
        std::iter::once(self.log.path()).chain(named).collect()
    }
}
