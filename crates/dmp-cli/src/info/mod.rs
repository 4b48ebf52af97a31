//! `dmp info`: what is in a log.

mod found;
mod render;

use std::io::Write;

use clap::Args;
use dmp::Config;

use crate::exit::Exit;
use crate::extrinsic::{self, Extrinsic};
use crate::log_args::{LogArgs, Mapper};
use crate::named::{Named, NamedFile};
use crate::runs::Runs;
use crate::trajectory_args::TrajectoryArgs;

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
    /// A trajectory to look at with the log: a file (TUM, KITTI rows, EuRoC, .npy, g2o, Redwood), `topic:/odom` of the
    /// log, or `BAG:/odom` of another bag
    #[arg(short = 't', long = "trajectory", value_name = "[NAME=]RUN", help_heading = "Input")]
    trajectories: Vec<NamedFile>,
    #[command(flatten)]
    reading: TrajectoryArgs,
    #[command(flatten)]
    log: LogArgs,
    /// With --made-with: where the sensor sat on the body, as identity, X,Y,Z,QX,QY,QZ,QW or calib:FILE
    #[arg(long, value_name = "EXTRINSIC", requires = "made_with")]
    #[arg(allow_hyphen_values = true, help_heading = "Place and time")]
    extrinsic: Vec<Named<Extrinsic>>,
    /// Added to every stamp of the log before it is looked up in a trajectory, seconds
    #[arg(long, value_name = "SECONDS", default_value = "0", value_parser = crate::score::parse::seconds_ns)]
    #[arg(allow_hyphen_values = true, help_heading = "Place and time")]
    time_offset: i64,
    /// More trajectories: what a shell makes of `-t runs/*.tum`
    #[arg(value_name = "[NAME=]RUN", hide = true)]
    more: Vec<NamedFile>,
    /// Print one JSON object (schema dmp-info/1)
    #[arg(long, help_heading = "Output")]
    json: bool,
}

pub(crate) fn run(arguments: &InfoArgs, out: &mut impl Write) -> anyhow::Result<Exit> {
    let files: Vec<NamedFile> = arguments.trajectories.iter().chain(&arguments.more).cloned().collect();
    let started = Runs::start(&files, &arguments.reading)?;
    let mapper = Mapper {
        body_from_sensor: extrinsic::of_mapper(&arguments.extrinsic)?,
        time_offset_ns: arguments.time_offset,
        max_gap_ns: None,
    };
    let survey = arguments.log.survey(&mapper, Config::default().threads)?;
    // Of several streams of scans none is the one whose frame moves.
    let frame = match survey.streams.as_slice() {
        [only] => only.log.as_ref().and_then(|log| log.summary().frame_id.clone()),
        _ => None,
    };
    let trajectories = started.finish_in(&survey.path, frame.as_deref())?;
    let info = found::Info::new(survey, &trajectories, arguments.time_offset);
    if arguments.json {
        serde_json::to_writer_pretty(&mut *out, &info).map_err(std::io::Error::from)?;
        writeln!(out)?;
    } else {
        render::info(out, &info)?;
    }
    let damaged = info.is_damaged() || trajectories.iter().any(|run| run.damaged);
    Ok(if damaged { Exit::InputDamaged } else { Exit::Done })
}
