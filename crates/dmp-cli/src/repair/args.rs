//! The options of `dmp repair`.

use std::path::PathBuf;

use clap::Args;
use dmp::DriftPairs;
use dmp_loops::RepairOptions;

use crate::clock_args::ClockArgs;
use crate::drift::pairs_at_most;
use crate::log_args::LogArgs;
use crate::named::NamedFile;
use crate::score::conventions::ConventionArgs;
use crate::settings::{PlaceArgs, ResourceArgs};
use crate::trajectory_args::TrajectoryArgs;

/// Mend a run by what it sees itself where it comes back
///
/// Visits to the same places are brought onto each other, as `dmp drift` does. What that says becomes loops of a pose graph of the
/// run; those that agree with each other and do not make the map worse are kept, as `dmp loops --accept` does, and all poses are
/// moved smoothly along. Both runs are then measured and scored beside each other. Where the run comes back to no place, is as
/// good as the measurement, or would not get better, nothing is written, and that is said.
#[derive(Debug, Args)]
#[command(
    override_usage = "dmp repair [OPTIONS] LOG -t [NAME=]RUN.tum -o REPAIRED.tum",
    after_help = "Examples:\n  \
    dmp repair drive.mcap -t run.tum -o repaired.tum\n  \
    dmp repair drive.mcap -t kiss=kiss_poses.npy --pose-at kiss=end -o repaired.tum --save-graph repaired.g2o\n  \
    dmp repair city.mcap -t run.tum --pairs 100 -o repaired.tum --json > repair.json\n\n\
    Exit codes: 0 done, also where there was nothing to mend; 1 failed; 2 wrong usage; 3 done, but part of the log was lost or damaged."
)]
pub(crate) struct RepairArgs {
    /// The run: its trajectory, as for `dmp score`
    #[arg(short = 't', long = "trajectory", value_name = "[NAME=]RUN", help_heading = "Input")]
    pub(super) trajectory: NamedFile,
    #[command(flatten)]
    pub(super) reading: TrajectoryArgs,
    #[command(flatten)]
    pub(super) log: LogArgs,
    #[command(flatten)]
    pub(super) place: PlaceArgs,
    #[command(flatten)]
    pub(super) clock: ClockArgs,
    #[command(flatten)]
    pub(super) conventions: ConventionArgs,
    /// Look at so many pairs of visits at most, evenly spread over the drive, or `all`
    #[arg(long, value_name = "N", default_value = "all", value_parser = pairs_at_most, help_heading = "Returns and map")]
    pairs: DriftPairs,
    /// Register visits so many times at most, each time from what came out before
    #[arg(long, value_name = "N", default_value_t = RepairOptions::default().most_rounds, value_parser = rounds)]
    #[arg(help_heading = "Returns and map")]
    rounds: usize,
    #[command(flatten)]
    pub(super) resources: ResourceArgs,
    /// The mended run, with the stamps of the run: TUM where these have stamps, else KITTI rows. Written only where it is mended
    #[arg(short, long, value_name = "FILE", help_heading = "Output")]
    pub(super) output: PathBuf,
    /// Its keyframes with their edges and the accepted loops, optimised, in g2o's format: vertices are called by the numbers of their
    /// scans
    #[arg(long, value_name = "FILE.g2o", help_heading = "Output")]
    pub(super) save_graph: Option<PathBuf>,
    /// Print one JSON object (schema dmp-repair/1) instead of tables
    #[arg(long, help_heading = "Output")]
    pub(super) json: bool,
}

fn rounds(text: &str) -> Result<usize, String> {
    text.parse()
        .ok()
        .filter(|&rounds| rounds > 0)
        .ok_or_else(|| "it must be a number of 1 or more".to_owned())
}

impl RepairArgs {
    pub(super) fn options(&self) -> RepairOptions {
        RepairOptions { pairs: self.pairs, most_rounds: self.rounds, ..RepairOptions::default() }
    }
}
