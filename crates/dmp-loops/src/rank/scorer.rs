//! What scores the poses of a graph.

use dmp::{Config, DriftPairs, Frame, Progress, evaluate};
use dmp_log::ScanLog;
use dmp_reduce::Estimate;
use dmp_sensor::Isometry3;

use crate::map::{LoopMap, MapScores, Placed};
use crate::{Keyframes, LoopError};

/// What scores the poses of a graph.
#[derive(Debug)]
pub struct Scorer<'a>(ScoredBy<'a>);

#[derive(Debug)]
enum ScoredBy<'a> {
    Graph,
    Patches(&'a LoopMap),
    Log(Box<WholeMaps<'a>>),
}

/// Poses that others are compared with, as what scores them needs them.
#[derive(Debug)]
pub(super) enum Before<'a> {
    Graph,
    Patches(Box<Placed<'a>>),
    Log(Box<WholeMaps<'a>>),
}

/// Maps fused from the log.
#[derive(Debug)]
pub(super) struct WholeMaps<'a> {
    log: &'a dyn ScanLog,
    keyframes: &'a Keyframes,
    /// Where there is a map that others are compared with, with its voxels: scores of other voxels are other scores.
    config: Config,
    without_m2: Option<f64>,
}

impl<'a> Scorer<'a> {
    /// The graph's own edges alone: no map is looked at.
    pub fn graph() -> Self {
        Self(ScoredBy::Graph)
    }

    /// The map that is put together of patches.
    pub fn patches(map: &'a LoopMap) -> Self {
        Self(ScoredBy::Patches(map))
    }

    /// The map that is fused from the log, and all returns: the log is read twice for every candidate, as
    /// [`evaluate`](dmp::evaluate) does. Its changes have no intervals.
    pub fn log(log: &'a dyn ScanLog, keyframes: &'a Keyframes, config: &Config) -> Self {
        let config = Config { drift: DriftPairs::None, ..config.clone() };
        Self(ScoredBy::Log(Box::new(WholeMaps { log, keyframes, config, without_m2: None })))
    }

    /// Whether candidates are scored beside each other; else each is by several threads.
    pub(super) fn is_parallel(&self) -> bool {
        !matches!(self.0, ScoredBy::Log(_))
    }

    /// Whether changes have intervals.
    pub(super) fn has_intervals(&self) -> bool {
        matches!(self.0, ScoredBy::Patches(_))
    }

    /// Scores poses that others are to be compared with.
    pub(super) fn begin_at(
        &self,
        world_from_body: &[Isometry3<f64>],
        progress: &dyn Progress,
    ) -> Result<(Before<'a>, Option<MapScores>), LoopError> {
        Ok(match &self.0 {
            ScoredBy::Graph => (Before::Graph, None),
            ScoredBy::Patches(map) => {
                let placed = Placed::new(map, world_from_body.to_vec())?;
                let scores = placed.score()?;
                (Before::Patches(Box::new(placed)), Some(scores))
            }
            ScoredBy::Log(maps) => {
                let (scores, config) = maps.score(world_from_body, progress)?;
                let maps = WholeMaps { config, without_m2: scores.ranked_m2(), ..**maps };
                (Before::Log(Box::new(maps)), Some(scores))
            }
        })
    }
}

impl Before<'_> {
    /// Scores poses; `alone` where no other poses are scored at the time.
    pub(super) fn score(
        &self,
        world_from_body: &[Isometry3<f64>],
        alone: bool,
        progress: &dyn Progress,
    ) -> Result<Option<MapScores>, LoopError> {
        match self {
            Self::Graph => Ok(None),
            Self::Patches(placed) => placed.moved_to(world_from_body, alone).map(Some),
            Self::Log(maps) => maps.score(world_from_body, progress).map(|(scores, _)| Some(scores)),
        }
    }
}

impl WholeMaps<'_> {
    /// The scores of poses, and the settings by which others are to be scored beside them: of the same voxels.
    fn score(
        &self,
        world_from_body: &[Isometry3<f64>],
        progress: &dyn Progress,
    ) -> Result<(MapScores, Config), LoopError> {
        let run = self.keyframes.run("graph", world_from_body)?;
        let report = evaluate(self.log, &[run], &self.config, &Quietly(progress))?;
        let of_run = &report.runs[0];
        let plain = |value_m2| Estimate { value_m2, returns: of_run.returns, interval: None };
        let near_m = report.config.scales.lengths().near_m;
        let r_near_m2 = std::array::from_fn(|k| (near_m[k], of_run.r_near_m2[k].map(plain)));
        let scores = MapScores { r_near_m2, change: None, cast_share: 1.0 };
        let change = scores.ranked_m2().zip(self.without_m2).map(|(with, without)| plain(with - without));
        let frame = Frame::of_report(report.inputs.runs[0].world_from_own);
        let config = Config { voxel_m: Some(report.config.voxel_m), frame, ..self.config.clone() };
        Ok((MapScores { change, ..scores }, config))
    }
}

/// Lets an evaluation among many be cancelled, and keeps its stages to itself.
struct Quietly<'a>(&'a dyn Progress);

impl Progress for Quietly<'_> {
    fn cancelled(&self) -> bool {
        self.0.cancelled()
    }
}
