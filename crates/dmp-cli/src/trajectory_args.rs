//! How the files of trajectories are read.

use std::path::PathBuf;

use clap::Args;
use dmp::PosesAs;
use dmp_log::{TimeUnit, TrajectoryFormat, read_trajectory};
use dmp_sensor::Trajectory;

use crate::exit::Usage;
use crate::named::{Named, NamedFile, assign};

/// How the files of trajectories are read.
#[derive(Debug, Default, Args)]
pub(crate) struct TrajectoryArgs {
    /// The format of the trajectories, where it is not to be found by looking: tum, kitti, euroc, npy, g2o, redwood or
    /// csv
    #[arg(long, value_name = "FORMAT", help_heading = "Input")]
    pub(crate) trajectory_format: Option<TrajectoryFormat>,
    /// The unit of the stamps in a trajectory's file, where it is not that of its format (s in TUM, ns in EuRoC) or is asked for:
    /// s, ms, us or ns; for the run NAME, or for all runs
    #[arg(long, value_name = "[NAME=]UNIT", help_heading = "Input")]
    time_unit: Vec<Named<TimeUnit>>,
    /// How the poses of a run are meant, where they are not `world_from_body` in metres with quaternions x y z w: `inverted`
    /// (`body_from_world`), `wxyz`, or places in `mm`, `cm` or `km`; for the run NAME, or for all runs. May be given more than
    /// once: each is applied to what the one before made
    #[arg(long, value_name = "[NAME=]WAY", help_heading = "Input")]
    poses_as: Vec<Named<PosesAs>>,
    /// For a run with poses of keyframes alone: a trajectory of the same body, as an odometry's, with poses between them; it may
    /// drift and have a world of its own. For the run NAME, or for all runs
    #[arg(long, value_name = "[NAME=]FILE", help_heading = "Input")]
    between: Vec<NamedFile>,
}

impl TrajectoryArgs {
    /// The trajectory that carries each run between its poses, where one is given.
    pub(crate) fn between(&self, names: &[&str]) -> anyhow::Result<Vec<Option<Trajectory>>> {
        let given = self.between.iter();
        let values = given.map(|file| (file.name.as_deref(), file.path.display().to_string(), &file.path));
        let read =
            |path: Option<&PathBuf>| path.map(|path| Ok(read_trajectory(path)?.trajectory)).transpose();
        assign("--between", names, values)?.into_iter().map(read).collect()
    }

    /// How the poses of each run are meant, in the order given.
    pub(crate) fn ways(&self, names: &[&str]) -> Result<Vec<Vec<PosesAs>>, Usage> {
        let mut ways = vec![Vec::new(); names.len()];
        for given in &self.poses_as {
            let of_runs = assign("--poses-as", names, [given.parts()])?;
            ways.iter_mut().zip(of_runs).for_each(|(ways, way)| ways.extend(way));
        }
        Ok(ways)
    }

    /// The unit of the stamps of each run, where one is given.
    pub(crate) fn units(&self, names: &[&str]) -> Result<Vec<Option<TimeUnit>>, Usage> {
        let units = assign("--time-unit", names, self.time_unit.iter().map(Named::parts))?;
        Ok(units.into_iter().map(Option::<&TimeUnit>::copied).collect())
    }
}
