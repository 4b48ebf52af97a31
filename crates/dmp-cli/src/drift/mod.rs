//! `dmp drift`: how far runs are off where they come back, by the surfaces that they see twice.

pub(crate) mod render;

use std::io::{self, Write};
use std::path::PathBuf;

use anyhow::bail;
use clap::Args;
use dmp::{Config, DriftPairs, DriftReach, MapSource, measure_drift};
use dmp_log::write_pose_edges;

use crate::clock_args::ClockArgs;
use crate::common::Common;
use crate::exit::{Exit, Usage, when_printed};
use crate::log_args::LogArgs;
use crate::named::NamedFile;
use crate::progress::Progress;
use crate::runs::{OpenedRuns, Runs};
use crate::save::save;
use crate::score::conventions::ConventionArgs;
use crate::settings::{PlaceArgs, ResourceArgs};
use crate::trajectory_args::TrajectoryArgs;

/// Measure in metres how far runs are off where they come back
///
/// Where a run visits a place twice, its scans of both visits are brought onto each other by the surfaces that both see: the
/// motion that this takes is what the run is off by between the visits. Every run is measured at the same places. No ground
/// truth is needed; a drive that never comes back tells nothing.
#[derive(Debug, Args)]
#[command(
    override_usage = "dmp drift [OPTIONS] LOG -t [NAME=]RUN.tum [-t [NAME=]RUN2.tum ...]",
    after_help = "Examples:\n  \
    dmp drift drive.mcap -t run.tum\n  \
    dmp drift drive.mcap -t kiss=kiss_poses.npy -t lio=lio.tum -v\n  \
    dmp drift city.mcap -t run.tum --pairs 50\n  \
    dmp drift drive.mcap -t lost.tum --far\n  \
    dmp drift drive.mcap -t run.tum -o constraints.g2o\n  \
    dmp drift drive.mcap -t run.tum --json > drift.json\n\n\
    Exit codes: 0 done; 1 failed; 2 wrong usage; 3 done, but part of the log was lost or damaged, or a run was left out."
)]
pub(crate) struct DriftArgs {
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
    #[command(flatten)]
    conventions: ConventionArgs,
    /// Look at so many pairs of visits at most, evenly spread over the drive, or `all`
    #[arg(long, value_name = "N", default_value = "all", value_parser = pairs_at_most, help_heading = "Returns and map")]
    pairs: DriftPairs,
    /// Also find visits of runs that are off by more than 10 m, up to about 25 m: pairs up to 40 m apart (15 m without), and starts
    /// of the registration up to 21 m away (6 m). Several times slower
    #[arg(long, help_heading = "Returns and map")]
    far: bool,
    #[command(flatten)]
    resources: ResourceArgs,
    /// Write what was measured as constraints for a pose graph: FILE.g2o with an `EDGE_SE3:QUAT` for each pair of visits that has
    /// an answer, between scans by their numbers in the log, with its information. Of one run
    #[arg(short, long, value_name = "FILE", help_heading = "Output")]
    output: Option<PathBuf>,
    /// Print one JSON object (schema dmp-drift/1) instead of tables
    #[arg(long, help_heading = "Output")]
    json: bool,
    /// Also print every pair of visits
    #[arg(short, long, conflicts_with = "json", help_heading = "Output")]
    verbose: bool,
}

/// A number of pairs, `all` or `none`.
pub(crate) fn drift_pairs(text: &str) -> Result<DriftPairs, String> {
    match text.parse() {
        _ if text == "all" => Ok(DriftPairs::All),
        _ if text == "none" => Ok(DriftPairs::None),
        Ok(count) if count > 0 => Ok(DriftPairs::AtMost(count)),
        _ => Err("it must be a number of pairs of 1 or more, `all` or `none`".to_owned()),
    }
}

/// Some of the pairs at least.
pub(crate) fn pairs_at_most(text: &str) -> Result<DriftPairs, String> {
    match drift_pairs(text) {
        Ok(pairs) if pairs != DriftPairs::None => Ok(pairs),
        _ => Err("it must be a number of pairs of 1 or more, or `all`".to_owned()),
    }
}

pub(crate) fn run(arguments: &DriftArgs, common: &Common, out: &mut impl Write) -> anyhow::Result<Exit> {
    let files: Vec<NamedFile> = arguments.trajectories.iter().chain(&arguments.more).cloned().collect();
    let started = Runs::start(&files, &arguments.reading)?;
    if arguments.output.is_some() && files.len() > 1 {
        bail!(Usage(format!(
            "-o: constraints are those of one run, not of {}: name one with -t",
            files.len()
        )));
    }
    let time_offset_ns = arguments.clock.offset_of_all_ns();
    let drift_reach = if arguments.far { DriftReach::Far } else { DriftReach::Near };
    let config = Config {
        time_offset_ns,
        drift: arguments.pairs,
        drift_reach,
        ..arguments.resources.in_config(Config::default())
    };
    let config = arguments.place.in_config(config);
    config.check()?;
    let poses = (&arguments.place, &arguments.clock);
    let fused = std::iter::repeat(MapSource::Fused);
    let opened = OpenedRuns::open(started, fused, &arguments.log, poses, config.threads, common)?;
    let (opened, vetted) = arguments.conventions.vet(opened, &arguments.log, poses, &config, common)?;
    let OpenedRuns { log, runs, damaged } = opened;
    let watch = Progress::new(common);
    let report = measure_drift(log.as_ref(), &runs, &config, &watch)?;
    drop(watch);
    if let (Some(path), [run]) = (&arguments.output, runs.as_slice()) {
        let body_from_sensor = run.body_from_sensor.unwrap_or(config.body_from_sensor);
        let edges = report.constraints(0, &body_from_sensor);
        save(path, |out| write_pose_edges(out, &edges))?;
    }
    let left_out = vetted.is_some_and(|vetted| vetted.is_kept().contains(&false));
    let exit = if damaged || left_out { Exit::InputDamaged } else { Exit::Done };
    let printed = if arguments.json {
        let written = serde_json::to_writer_pretty(&mut *out, &report).map_err(io::Error::from);
        written.and_then(|()| writeln!(out))
    } else {
        render::report(out, &report, config.scales_on(log.summary()), arguments.verbose)
    };
    when_printed(printed.map_err(Into::into), exit)
}
