//! When a run's poses hold: `--time-offset`, `--pose-at`.

use std::str::FromStr;

use clap::Args;
use dmp::PoseAt;

use crate::exit::Usage;
use crate::named::{Named, assign};
use crate::score::parse;

/// When the poses of runs hold, on the log's clock.
#[derive(Debug, Args)]
pub(crate) struct ClockArgs {
    /// Added to every stamp of the log before poses are looked up, seconds; for the run NAME, or for all runs [default: 0]
    #[arg(long, value_name = "[NAME=]SECONDS")]
    #[arg(allow_hyphen_values = true, help_heading = "Place and time")]
    time_offset: Vec<Named<Offset>>,
    /// At which instant of its scan a pose holds whose stamp is that of the scan, or that has none: `start`, `middle` or
    /// `end` of its returns, or `stamp`, the stamp itself; for the run NAME, or for all runs [default: stamp]
    #[arg(long, value_name = "[NAME=]INSTANT", help_heading = "Place and time")]
    pose_at: Vec<Named<PoseAt>>,
}

/// How much later the log's stamps are looked up, nanoseconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Offset(i64);

impl FromStr for Offset {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        parse::seconds_ns(text).map(Self)
    }
}

/// When the poses of one run hold.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct RunClock {
    /// `None`: as for all runs.
    pub(crate) time_offset_ns: Option<i64>,
    pub(crate) pose_at: PoseAt,
}

impl ClockArgs {
    /// What holds for runs that have no offset of their own, nanoseconds.
    pub(crate) fn offset_of_all_ns(&self) -> i64 {
        Named::of_all(&self.time_offset).map_or(0, |offset| offset.0)
    }

    /// Each run's.
    pub(crate) fn of_runs(&self, names: &[&str]) -> Result<Vec<RunClock>, Usage> {
        let offsets = assign("--time-offset", names, self.time_offset.iter().map(Named::parts))?;
        let instants = assign("--pose-at", names, self.pose_at.iter().map(Named::parts))?;
        let clock = |(offset, pose_at): (Option<&Offset>, Option<&PoseAt>)| RunClock {
            time_offset_ns: offset.map(|offset| offset.0),
            pose_at: pose_at.copied().unwrap_or_default(),
        };
        Ok(offsets.into_iter().zip(instants).map(clock).collect())
    }
}
