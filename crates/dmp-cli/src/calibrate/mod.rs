//! `dmp calibrate`: when and where a run's poses hold, by the scans themselves.

mod numbers;

use std::io::{self, Write};
use std::path::PathBuf;

use clap::Args;
use dmp::{Config, ConventionsReport, MapSource, Run, profiles, vet};
use dmp_log::shown_path;
use serde::Serialize;

use crate::clock_args::ClockArgs;
use crate::common::Common;
use crate::exit::{Exit, option_of};
use crate::log_args::LogArgs;
use crate::named::NamedFile;
use crate::progress::Progress;
use crate::runs::{OpenedRuns, Runs};
use crate::save::{OutputsFolder, SavedTogether};
use crate::say::tell;
use crate::settings::PlaceArgs;
use crate::trajectory_args::TrajectoryArgs;
use crate::vetting::Vetting;

/// Find when and where a run's poses hold
///
/// Looks for errors of a run's clock and of the sensor's mounting by the surfaces that several scans see: with what is right
/// they are thinnest. Says what is found with an interval for each, and what the scans do not show: height over flat ground,
/// time on a straight road at even speed. No ground truth and no target is needed. What puts an error right is told as an
/// option of `dmp score`, whose --mend does the same.
#[derive(Debug, Args)]
#[command(
    override_usage = "dmp calibrate [OPTIONS] LOG -t [NAME=]RUN.tum [-t [NAME=]RUN2.tum ...]",
    after_help = "Examples:\n  \
    dmp calibrate drive.mcap -t run.tum\n  \
    dmp calibrate drive.mcap -t kiss=kiss_poses.npy -t lio=lio.tum --extrinsic lio=0,0,0.28,0,0,0,1\n  \
    dmp calibrate drive.mcap -t run.tum --plots figures/\n  \
    dmp calibrate drive.mcap -t run.tum --json\n\n\
    Exit codes: 0 done; 1 failed; 2 wrong usage; 3 done, but part of the log was lost or damaged, or a run does not belong to it."
)]
pub(crate) struct CalibrateArgs {
    /// A run: its trajectory, as for `dmp score`
    #[arg(short = 't', long = "trajectory", value_name = "[NAME=]RUN", help_heading = "Input")]
    #[arg(required_unless_present = "more")]
    trajectories: Vec<NamedFile>,
    #[command(flatten)]
    reading: TrajectoryArgs,
    #[command(flatten)]
    log: LogArgs,
    /// More runs: what a shell makes of `-t runs/*.tum`
    #[arg(value_name = "[NAME=]RUN", hide = true)]
    more: Vec<NamedFile>,
    #[command(flatten)]
    place: PlaceArgs,
    #[command(flatten)]
    clock: ClockArgs,
    /// Print one JSON object (schema dmp-calibrate/1) instead of tables
    #[arg(long, help_heading = "Output")]
    json: bool,
    /// Draw, for each number, how thick surfaces are with values of it, the others being put right where that pays, as SVG in this folder; it
    /// is made if need be. Takes ten times as long as looking
    #[arg(long, value_name = "FOLDER", help_heading = "Output")]
    plots: Option<PathBuf>,
}

/// The JSON.
#[derive(Debug, Serialize)]
struct Found {
    schema: &'static str,
    dmp_version: &'static str,
    log: String,
    runs: Vec<FoundRun>,
    messages: Vec<String>,
}

/// A run in it.
#[derive(Debug, Serialize)]
struct FoundRun {
    name: String,
    belongs: bool,
    #[serde(flatten)]
    conventions: ConventionsReport,
}

pub(crate) fn run(arguments: &CalibrateArgs, common: &Common, out: &mut impl Write) -> anyhow::Result<Exit> {
    let files: Vec<NamedFile> = arguments.trajectories.iter().chain(&arguments.more).cloned().collect();
    let started = Runs::start(&files, &arguments.reading)?;
    let time_offset_ns = arguments.clock.offset_of_all_ns();
    let config = arguments.place.in_config(Config { time_offset_ns, ..Config::default() });
    config.check()?;
    let _plots = arguments.plots.as_deref().map(OutputsFolder::make).transpose()?;
    let poses = (&arguments.place, &arguments.clock);
    let fused = std::iter::repeat(MapSource::Fused);
    let opened = OpenedRuns::open(started, fused, &arguments.log, poses, config.threads, common)?;
    let mapper = arguments.place.mapper(time_offset_ns)?;
    let given: Vec<Run> = opened.runs.clone();
    let (OpenedRuns { log, damaged, .. }, vetted) = Vetting { log: &arguments.log, mend: false }.vet(
        opened,
        |log| log.open(&mapper, config.threads),
        |log, runs| vet(log.as_ref(), runs, &config, false, &Progress::new(common)),
    )?;
    if let Some(folder) = &arguments.plots {
        let progress = Progress::new(common);
        let mut pictures = SavedTogether::default();
        for profile in profiles(log.as_ref(), &given, &vetted.found, &config, &progress)? {
            let names: Vec<&str> = given.iter().map(|run| run.name.as_str()).collect();
            let path = folder.join(format!("{}.svg", profile.axis.name()));
            let picture = numbers::plot(&profile, &names).to_svg();
            pictures.add(&path, |out| out.write_all(picture.as_bytes()))?;
        }
        pictures.commit()?;
    }
    let found = Found {
        schema: "dmp-calibrate/1",
        dmp_version: env!("CARGO_PKG_VERSION"),
        log: shown_path(&log.summary().path),
        runs: vetted
            .found
            .iter()
            .map(|found| FoundRun {
                name: found.name.clone(),
                belongs: found.left_out.is_none(),
                conventions: found.report(false, &option_of),
            })
            .collect(),
        messages: vetted.messages_with(&option_of),
    };
    if arguments.json {
        serde_json::to_writer_pretty(&mut *out, &found).map_err(io::Error::from)?;
        writeln!(out)?;
    } else {
        for run in &found.runs {
            numbers::table(out, &run.name, &run.conventions)?;
        }
        if found.messages.is_empty() {
            writeln!(out, "Nothing is surely off.")?;
        }
        found.messages.iter().try_for_each(|message| tell!(out, "{message}"))?;
    }
    let incomplete = damaged || found.runs.iter().any(|run| !run.belongs);
    Ok(if incomplete { Exit::InputDamaged } else { Exit::Done })
}
