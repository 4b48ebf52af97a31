//! `dmp info`: what is in a log.

mod found;
mod render;

use std::io::Write;

use clap::Args;
use dmp_log::TrajectoryFormat;

use crate::Exit;
use crate::log_args::LogArgs;
use crate::runs::{self, NamedFile};

/// Tell what is in a log: topics, fields, scans, times, damage
///
/// Also where a log cannot be scored without being told more: several topics with scans, times that could mean
/// this or that. With trajectories, also how many of the scans they cover.
#[derive(Debug, Args)]
#[command(
    override_usage = "dmp info [OPTIONS] LOG [-t [NAME=]RUN.tum ...]",
    after_help = "Examples:\n  \
    dmp info drive.mcap\n  \
    dmp info drive.mcap --topic /front/points -t runs/*.tum\n  \
    dmp info kitti/07/ --json"
)]
pub(crate) struct InfoArgs {
    /// A trajectory to look at with the log: TUM, KITTI rows, EuRoC, .npy or g2o
    #[arg(short = 't', long = "trajectory", value_name = "[NAME=]RUN", help_heading = "Input")]
    trajectories: Vec<NamedFile>,
    /// The format of the trajectories, where it is not to be found by looking: tum, kitti, euroc, npy or g2o
    #[arg(long, value_name = "FORMAT", help_heading = "Input")]
    trajectory_format: Option<TrajectoryFormat>,
    #[command(flatten)]
    log: LogArgs,
    /// More trajectories: what a shell makes of `-t runs/*.tum`
    #[arg(value_name = "[NAME=]RUN", hide = true)]
    more: Vec<NamedFile>,
    /// Print one JSON object (schema dmp-info/1)
    #[arg(long, help_heading = "Output")]
    json: bool,
}

pub(crate) fn run(arguments: &InfoArgs, out: &mut impl Write) -> anyhow::Result<Exit> {
    let files: Vec<NamedFile> = arguments.trajectories.iter().chain(&arguments.more).cloned().collect();
    let trajectories = runs::load(&files, arguments.trajectory_format)?;
    let info = found::Info::new(arguments.log.survey()?, &trajectories);
    if arguments.json {
        serde_json::to_writer_pretty(&mut *out, &info).map_err(std::io::Error::from)?;
        writeln!(out)?;
    } else {
        render::info(out, &info)?;
    }
    Ok(if info.is_damaged() { Exit::InputDamaged } else { Exit::Done })
}
