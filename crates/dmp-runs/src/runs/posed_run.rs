//! A run as the passes have it: in its frame, on the log's clock, with its map as far as it is made.

use std::sync::Arc;

use dmp_sensor::Isometry3;

use crate::asked::Run;
use crate::runs::file_stem::file_stem_of;
use crate::runs::path::RunPath;
use crate::runs::run_poses::RunPoses;

/// A run and its state. `M` is its map at the current stage: the given store, the map being fused, the
/// finished map, the caster into it, its summary for the report.
#[derive(Debug, Clone)]
pub struct PosedRun<'a, M> {
    /// As the user gave it.
    pub run: &'a Run,
    /// Its name as a file name.
    pub file_stem: String,
    /// The sensor's poses, in the world in which the run is scored.
    pub poses: RunPoses,
    /// The frame of the run's trajectory.
    pub own_from_world: Isometry3<f64>,
    /// Its path through the scans in use.
    pub path: Arc<RunPath>,
    /// A likely error of the input, in words.
    pub hint: Option<String>,
    /// Its map at this stage.
    pub map: M,
}

impl<'a, M> PosedRun<'a, M> {
    /// The run of this number among `runs`, in its given frame.
    pub fn new(runs: &'a [Run], number: usize, (poses, path): (RunPoses, RunPath), map: M) -> Self {
        let run = &runs[number];
        let names: Vec<&str> = runs.iter().map(|run| run.name.as_str()).collect();
        let (file_stem, own_from_world) = (file_stem_of(&names, &run.name), Isometry3::identity());
        Self { run, file_stem, poses, own_from_world, path: Arc::new(path), hint: None, map }
    }

    /// The same run with another map, and its previous map.
    pub fn with_map<N>(self, map: N) -> (PosedRun<'a, N>, M) {
        (self.like(map), self.map)
    }

    /// A run like this one, with another map.
    pub fn like<N>(&self, map: N) -> PosedRun<'a, N> {
        let Self { run, file_stem, poses, own_from_world, path, hint, .. } = self;
        PosedRun {
            run,
            file_stem: file_stem.clone(),
            poses: poses.clone(),
            own_from_world: *own_from_world,
            path: Arc::clone(path),
            hint: hint.clone(),
            map,
        }
    }

    /// The same run on another path.
    #[must_use]
    pub fn with_path(self, path: RunPath) -> Self {
        Self { path: Arc::new(path), ..self }
    }

    /// The run's name.
    pub fn name(&self) -> &'a str {
        &self.run.name
    }
}

/// The poses and paths of some runs.
pub fn posed<'s, M>(
    runs: &'s [PosedRun<'_, M>],
) -> impl Iterator<Item = (&'s RunPoses, &'s RunPath)> + Clone {
    runs.iter().map(|run| (&run.poses, &*run.path))
}
