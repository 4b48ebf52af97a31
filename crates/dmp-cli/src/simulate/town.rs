use std::io::{IsTerminal as _, Write};
use std::path::PathBuf;

use clap::{Args, ValueEnum};
use dmp_sim::{LidarOptions, NoReturn, Recording, RecordingOptions, Route, Sweep};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::told;
use crate::log_writer::{CompressionArg, LogWriter, OutputFormat};
use crate::save::save_trajectory;
use crate::{Common, Exit, parse};

/// Make a log of a drive through a simulated town, and its true trajectory
///
/// The town is made of the seed: streets of 14 m with houses on both sides, hills, trees, poles, parked and
/// moving cars. The sensor turns while it moves; every return has its own time. World, body and sensor
/// have z up; the trajectory is the sensor's.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    dmp simulate town -o town.mcap\n  \
    dmp simulate town -o drive/ --beams 64 --azimuth-steps 2048 --scans 1000 --route out-and-back\n  \
    dmp simulate town -o traffic.mcap --traffic 20 --scans 600 --seed 7")]
pub(crate) struct TownArgs {
    /// The log: FILE.mcap, or a FOLDER/ of KITTI scans (.bin) with times
    #[arg(short, long, value_name = "LOG")]
    output: PathBuf,
    /// The true trajectory: FILE.tum, or FILE.txt for KITTI rows, one a scan [default: LOG.truth.tum]
    #[arg(long, value_name = "FILE")]
    truth: Option<PathBuf>,
    /// Poses of the true trajectory per second, Hz
    #[arg(long, default_value_t = 20.0, value_name = "HZ")]
    truth_rate: f64,
    /// Another number makes another town, another drive, other noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Beams of the sensor
    #[arg(long, default_value_t = 16)]
    beams: usize,
    /// Elevation of the lowest and highest beam, degrees [default: -15,15; -25,15 for more than 16 beams]
    #[arg(long, value_name = "LOW,HIGH", allow_hyphen_values = true, value_parser = parse::elevations_rad)]
    elevation: Option<[f64; 2]>,
    /// Firings per turn
    #[arg(long, default_value_t = 900, value_name = "N")]
    azimuth_steps: usize,
    /// Turns per second, Hz; every turn is a scan
    #[arg(long, default_value_t = 10.0, value_name = "HZ")]
    rate: f64,
    /// Number of scans
    #[arg(long, default_value_t = 600, value_name = "N")]
    scans: usize,
    /// Speed on straight streets, m/s; curves are slower
    #[arg(long, default_value_t = 6.0, value_name = "M/S")]
    speed: f64,
    /// Where the drive goes
    #[arg(long, value_enum, default_value_t = RouteArg::Loop)]
    route: RouteArg,
    /// Number of moving cars
    #[arg(long, default_value_t = 0, value_name = "N")]
    traffic: usize,
    /// Standard deviation of the measured ranges, e.g. 0.02 (metres) or 2cm
    #[arg(long, default_value = "0.02", value_name = "LENGTH", value_parser = parse::length_m)]
    range_noise: f64,
    /// Range of the farthest return of a bright surface seen straight on, metres
    #[arg(long, default_value = "100", value_name = "LENGTH", value_parser = parse::length_m)]
    max_range: f64,
    /// Share of the returns that get lost for no reason
    #[arg(long, default_value_t = 0.01, value_name = "SHARE")]
    drop_out: f64,
    /// Coordinates are rounded to multiples of this many metres, 0 for none; powers of two keep files small
    #[arg(long, default_value_t = 1.0 / 512.0, value_name = "METRES")]
    resolution: f64,
    /// What the log holds where nothing came back
    #[arg(long, value_enum, default_value_t = NoReturnArg::Omit)]
    no_return: NoReturnArg,
    /// Each scan at one instant, as if the sensor stood still during the turn, without times of its returns
    #[arg(long)]
    instant: bool,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum RouteArg {
    /// Round blocks, again and again: about a third of the drive is a revisit
    Loop,
    /// Out and back in the opposite lane
    OutAndBack,
    /// No street twice
    OneWay,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum NoReturnArg {
    /// Nothing
    Omit,
    /// The point (0, 0, 0)
    Zero,
    /// A point of NaNs
    Nan,
}

impl TownArgs {
    fn recording(&self) -> RecordingOptions {
        let common = LidarOptions::with_beams(self.beams);
        let lidar = LidarOptions {
            elevation_rad: self.elevation.unwrap_or(common.elevation_rad),
            azimuth_steps: self.azimuth_steps,
            rate_hz: self.rate,
            max_range_m: self.max_range,
            range_noise_m: self.range_noise,
            drop_out: self.drop_out,
            resolution_m: self.resolution,
            no_return: match self.no_return {
                NoReturnArg::Omit => NoReturn::Omitted,
                NoReturnArg::Zero => NoReturn::Zero,
                NoReturnArg::Nan => NoReturn::NotANumber,
            },
            sweep: if self.instant { Sweep::Instant } else { Sweep::Spinning },
            ..common
        };
        let route = match self.route {
            RouteArg::Loop => Route::Loop,
            RouteArg::OutAndBack => Route::OutAndBack,
            RouteArg::OneWay => Route::OneWay,
        };
        let (seed, scans, speed_m_s, traffic) = (self.seed, self.scans, self.speed, self.traffic);
        RecordingOptions { seed, scans, route, speed_m_s, traffic, lidar }
    }
}

pub(super) fn run(arguments: &TownArgs, common: &Common, out: &mut impl Write) -> anyhow::Result<Exit> {
    let options = arguments.recording();
    let town = options.town().map_err(told)?;
    let recording = Recording::new(&town, &options).map_err(told)?;
    let truth_path = arguments.truth.clone().unwrap_or_else(|| arguments.output.with_extension("truth.tum"));
    let truth = if truth_path.extension().is_some_and(|extension| extension == "txt") {
        recording.pose_per_scan()?
    } else {
        recording.drive().trajectory(arguments.truth_rate).map_err(told)?
    };

    let format = OutputFormat::of_name(&arguments.output)?;
    let mut log = LogWriter::create(&arguments.output, format, CompressionArg::Zstd)?;
    let progress = progress(common, recording.len());
    let mut returns = 0;
    for scan in recording.scans() {
        returns += scan.len();
        log.write(&scan)?;
        progress.inc(1);
    }
    log.finish()?;
    progress.finish_and_clear();
    save_trajectory(&truth_path, &truth)?;

    let (travel_m, revisits) = recording.travel_and_revisits();
    writeln!(
        out,
        "{}: {} scans, {returns} returns, {travel_m:.1} m of travel, {:.0} % of the scans where it was before",
        arguments.output.display(),
        recording.len(),
        revisits * 100.0,
    )?;
    writeln!(out, "{}: {} poses", truth_path.display(), truth.len())?;
    Ok(Exit::Done)
}

fn progress(common: &Common, scans: usize) -> ProgressBar {
    let shown = !common.quiet && !common.no_progress && std::io::stderr().is_terminal();
    let target = if shown { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
    let bar = ProgressBar::with_draw_target(Some(scans as u64), target);
    // The template is fixed: a wrong one would show in any run on a terminal.
    match ProgressStyle::with_template("{bar:30} {pos}/{len} scans, {per_sec}, {eta} left") {
        Ok(style) => bar.with_style(style),
        Err(_) => bar,
    }
}
