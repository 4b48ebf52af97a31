//! A run on its way through an evaluation.

use dmp_sensor::Isometry3;

use crate::config::Run;
use crate::file_stem::file_stem_of;
use crate::run_poses::RunPoses;

/// A run, with what is known of it so far. `M` is its map as far as it is made: the store that was given, what is being
/// fused, the finished map, the caster into it, what the report has of it.
#[derive(Debug, Clone)]
pub(crate) struct RunState<'a, M> {
    /// As the user has it.
    pub(crate) run: &'a Run,
    /// Its name as the name of a file.
    pub(crate) file_stem: String,
    /// Where the sensor was, in the world that the run is scored in.
    pub(crate) poses: RunPoses,
    /// The frame that the run's trajectory was given in.
    pub(crate) own_from_world: Isometry3<f64>,
    /// Scans that were asked for and have no pose in it.
    pub(crate) scans_without_pose: usize,
    /// Those that have one only between poses that are too far apart.
    pub(crate) scans_between_poses: usize,
    /// What is likely wrong with it, in words.
    pub(crate) hint: Option<String>,
    pub(crate) map: M,
}

impl<'a, M> RunState<'a, M> {
    /// Of all `runs` the one of this number, in the frame that it was given in.
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

    /// The same run with another map, and the map that it had.
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

    /// How the run is called.
    pub(crate) fn name(&self) -> &'a str {
        &self.run.name
    }
}

/// The poses of some runs.
pub(crate) fn poses_of<'s, M>(runs: &'s [RunState<'_, M>]) -> impl Iterator<Item = &'s RunPoses> + Clone {
    runs.iter().map(|run| &run.poses)
}
