//! When a run's poses hold: `--time-offset`, `--pose-at`.

use dmp::PoseAt;

use crate::console::Usage;
use crate::named::{Named, assign};
use crate::options::{Asked, input};

/// When the poses of one run hold.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct RunClock {
    /// `None`: as for all runs.
    pub(crate) time_offset_ns: Option<i64>,
    pub(crate) pose_at: Option<PoseAt>,
}

impl RunClock {
    /// Each run's.
    pub(crate) fn of_runs(asked: &Asked, names: &[&str]) -> Result<Vec<Self>, Usage> {
        let (offsets, instants) = (asked.all(&input::TIME_OFFSET), asked.all(&input::POSE_AT));
        let offsets = assign("--time-offset", names, offsets.iter().map(Named::parts))?;
        let instants = assign("--pose-at", names, instants.iter().map(Named::parts))?;
        let both = offsets.into_iter().zip(instants);
        let clock = both.map(|(offset, pose_at)| Self {
            time_offset_ns: offset.map(|offset| offset.0),
            pose_at: pose_at.copied(),
        });
        Ok(clock.collect())
    }
}
