//! `dmp simulate town`: a drive through a small town.

use dmp_draw::text::counted;
use std::io::Write;
use std::path::PathBuf;

use clap::{Args, ValueEnum};
use dmp_sim::{Recording, RecordingOptions, Route, Scenery};

use super::fault::told;
use super::progress::Progress;
use super::recording::{RecordingArgs, refuse_other_truth, save_scans, truth_path};
use crate::common::Common;
use crate::exit::{Exit, Usage};
use crate::log_writer::{CompressionArg, LogWriter, OutputFormat};
use crate::parse;
use crate::save::{save_trajectory, write_trajectory};

/// Make a log of a drive through a simulated town, and its true trajectory
///
/// The town is made of the seed: streets of 14 m with houses on both sides, hills, trees, poles, parked and
/// moving cars. The sensor turns while it moves; every return has its own time. World, body and sensor
/// have z up; the trajectory is the sensor's. Other scenery is made to fool what registers two visits of a place:
/// streets that look the same everywhere, and a tunnel in which nothing holds a place along it.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    dmp simulate town -o town.mcap\n  \
    dmp simulate town -o drive/ --beams 64 --azimuth-steps 2048 --scans 1000 --route out-and-back\n  \
    dmp simulate town -o traffic.mcap --traffic 20 --scans 600 --seed 7\n  \
    dmp simulate town -o alike.mcap --scenery alike --period 8m\n  \
    dmp simulate town -o tunnel.mcap --scenery tunnel --truth tunnel.tum")]
pub(crate) struct TownArgs {
    /// The true trajectory: FILE.tum, or FILE.txt for KITTI rows, one a scan [default: LOG.truth.tum,
    /// where there must be no other yet]
    #[arg(long = "truth", value_name = "FILE")]
    save_truth: Option<PathBuf>,
    /// Beams of the sensor
    #[arg(long, default_value_t = 16)]
    beams: usize,
    /// Firings per turn
    #[arg(long, default_value_t = 900, value_name = "N")]
    azimuth_steps: usize,
    /// Number of scans
    #[arg(long, default_value_t = 600, value_name = "N")]
    scans: usize,
    /// Speed on straight streets, m/s; curves are slower
    #[arg(long, default_value_t = 6.0, value_name = "M/S")]
    speed: f64,
    /// What stands along the streets
    #[arg(long, value_enum, default_value_t = SceneryArg::Varied)]
    scenery: SceneryArg,
    /// From one house to the next with `--scenery alike`, e.g. 8 (metres), 6 to 40 m [default: 8]
    #[arg(long, value_name = "LENGTH", value_parser = parse::length_m)]
    period: Option<f64>,
    /// Where the drive goes [default: loop; with other scenery than varied: straight]
    #[arg(long, value_enum)]
    route: Option<RouteArg>,
    /// Number of moving cars
    #[arg(long, default_value_t = 0, value_name = "N")]
    traffic: usize,
    #[command(flatten)]
    recording: RecordingArgs,
}

/// From one house to the next where they are alike, metres.
const PERIOD_M: f64 = 8.0;

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum SceneryArg {
    /// Houses, trees, poles and parked cars, no two alike, on hills
    Varied,
    /// The same house, tree, pole and parked car again every `--period`, on level ground: a street shifted by it is the
    /// same but for its ends, 144 m away from each other or a little more (96 m, northwards)
    Alike,
    /// None: a straight bare tunnel 12 m wide and 6 m high without an end in sight; only `--route straight` leads through
    Tunnel,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum RouteArg {
    /// Round blocks, again and again: about a third of the drive is a revisit
    Loop,
    /// Out and back in the opposite lane
    OutAndBack,
    /// Straight out along one street, round at a crossing, and back in the opposite lane
    Straight,
    /// No street twice
    OneWay,
}

impl TownArgs {
    fn scenery(&self) -> anyhow::Result<Scenery> {
        match (self.scenery, self.period) {
            (SceneryArg::Alike, period) => Ok(Scenery::Alike { period_m: period.unwrap_or(PERIOD_M) }),
            (_, Some(_)) => Err(Usage("--period is of --scenery alike alone".to_owned()).into()),
            (SceneryArg::Varied, None) => Ok(Scenery::Varied),
            (SceneryArg::Tunnel, None) => Ok(Scenery::Tunnel),
        }
    }

    fn options(&self) -> RecordingOptions {
        let lidar = self.recording.lidar(self.beams, self.azimuth_steps);
        let usual = if self.scenery == SceneryArg::Varied { RouteArg::Loop } else { RouteArg::Straight };
        let route = match self.route.unwrap_or(usual) {
            RouteArg::Loop => Route::Loop,
            RouteArg::OutAndBack => Route::OutAndBack,
            RouteArg::Straight => Route::Straight,
            RouteArg::OneWay => Route::OneWay,
        };
        let (seed, scans) = (self.recording.seed, self.scans);
        let (speed_m_s, traffic) = (self.speed, self.traffic);
        RecordingOptions { seed, scans, route, speed_m_s, traffic, lidar }
    }
}

pub(super) fn run(arguments: &TownArgs, common: &Common, out: &mut impl Write) -> anyhow::Result<Exit> {
    let RecordingArgs { output, truth_rate, .. } = &arguments.recording;
    let options = arguments.options();
    let town = options.town_of(arguments.scenery()?).map_err(told)?;
    let recording = Recording::new(&town, &options).map_err(told)?;
    let named = arguments.save_truth.as_deref();
    let truth_path = truth_path(output, named);
    let truth = if truth_path.extension().is_some_and(|extension| extension == "txt") {
        recording.pose_per_scan()?
    } else {
        recording.drive().trajectory(*truth_rate).map_err(told)?
    };
    refuse_other_truth(&truth_path, named, |out| write_trajectory(out, &truth))?;

    let format = OutputFormat::of_name(output)?;
    let log = LogWriter::create(output, format, CompressionArg::Zstd)?;
    let progress = Progress::new(common, recording.len());
    let returns = save_scans(recording.scans(), log, &progress)?;
    drop(progress);
    save_trajectory(&truth_path, &truth)?;

    let (travel_m, revisits) = recording.travel_and_revisits();
    writeln!(
        out,
        "{}: {}, {}, {travel_m:.1} m of travel, {:.0} % of the scans where it was before",
        output.display(),
        counted(recording.len() as u64, "scan"),
        counted(returns, "return"),
        revisits * 100.0,
    )?;
    writeln!(out, "{}: {}", truth_path.display(), counted(truth.len() as u64, "pose"))?;
    Ok(Exit::Done)
}
