//! The state of a run during an evaluation.

use dmp_sensor::Isometry3;

use crate::config::Run;
use crate::file_stem::file_stem_of;
use crate::run_poses::RunPoses;

/// A run and its state. `M` is its map at the current stage: the given store, the map being fused, the
/// finished map, the caster into it, its summary for the report.
#[derive(Debug, Clone)]
pub(crate) struct RunState<'a, M> {
    /// As the user gave it.
    pub(crate) run: &'a Run,
    /// Its name as a file name.
    pub(crate) file_stem: String,
    /// The sensor's poses, in the world in which the run is scored.
    pub(crate) poses: RunPoses,
    /// The frame of the run's trajectory.
    pub(crate) own_from_world: Isometry3<f64>,
    /// Number of requested scans without a pose in it.
    pub(crate) scans_without_pose: usize,
    /// Those with poses on both sides, but too far apart.
    pub(crate) scans_between_poses: usize,
    /// A likely error of the input, in words.
    pub(crate) hint: Option<String>,
    pub(crate) map: M,
}

impl<'a, M> RunState<'a, M> {
    /// The run of this number among `runs`, in its given frame.
    pub(crate) fn new(runs: &'a [Run], number: usize, poses: RunPoses, map: M) -> Self {
        let run = &runs[number];
        let names: Vec<&str> = runs.iter().map(|run| run.name.as_str()).collect();
        let (file_stem, own_from_world) = (file_stem_of(&names, &run.name), Isometry3::identity());
        Self {
            run,
            file_stem,
            poses,
            own_from_world,
            scans_without_pose: 0,
            scans_between_poses: 0,
            hint: None,
            map,
        }
    }

    /// The same run with another map, and its previous map.
    pub(crate) fn with_map<N>(self, map: N) -> (RunState<'a, N>, M) {
        (self.like(map), self.map)
    }

    /// A run like this one, with another map.
    pub(crate) fn like<N>(&self, map: N) -> RunState<'a, N> {
        let Self {
            run, file_stem, poses, own_from_world, scans_without_pose, scans_between_poses, hint, ..
        } = self;
        RunState {
            run,
            file_stem: file_stem.clone(),
            poses: poses.clone(),
            own_from_world: *own_from_world,
            scans_without_pose: *scans_without_pose,
            scans_between_poses: *scans_between_poses,
            hint: hint.clone(),
            map,
        }
    }

    /// The run's name.
    pub(crate) fn name(&self) -> &'a str {
        &self.run.name
    }
}

/// The poses of some runs.
pub(crate) fn poses_of<'s, M>(runs: &'s [RunState<'_, M>]) -> impl Iterator<Item = &'s RunPoses> + Clone {
    runs.iter().map(|run| &run.poses)
}
