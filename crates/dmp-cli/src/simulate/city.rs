//! `dmp simulate city`: a drive of any length.

use dmp_draw::text::counted;
use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use dmp_log::write_tum_poses;
use dmp_sim::{CityOptions, CityRecording};

use super::fault::told;
use super::progress::Progress;
use super::recording::{RecordingArgs, refuse_other_truth, save_scans, truth_path};
use crate::common::Common;
use crate::exit::Exit;
use crate::log_writer::{CompressionArg, LogWriter, OutputFormat};
use crate::save::save;

/// Make a log of a drive of any length through a city without end, and its true trajectory
///
/// The city is made where the sensor is, of the seed and the place: streets and avenues with houses, halls,
/// parks and squares on hilly ground, trees, poles and parked cars. Memory does not grow with the length of the
/// drive. The road goes round some blocks, in part for a second time, and on to new ground.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    dmp simulate city --km 1 --beams 64 -o city.mcap\n  \
    dmp simulate city --km 100 --beams 128 --revisit 0.5 -o long.mcap\n  \
    dmp simulate city --km 20 --revisit 0 --seed 7 -o one-way.mcap")]
pub(crate) struct CityArgs {
    /// Length of the drive, kilometres, from 0.05 to 1000
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    km: f64,
    /// Beams of the sensor
    #[arg(long, default_value_t = 64)]
    beams: usize,
    /// Firings per turn
    #[arg(long, default_value_t = 1024, value_name = "N")]
    azimuth_steps: usize,
    /// Speed on straight streets, m/s; curves are slower
    #[arg(long, default_value_t = 10.0, value_name = "M/S")]
    speed: f64,
    /// Share of the way that is driven for a second time, up to 0.9; with 0 the road never comes back
    #[arg(long, default_value_t = 0.3, value_name = "SHARE", allow_negative_numbers = true)]
    revisit: f64,
    /// The true trajectory, FILE.tum [default: LOG.truth.tum, where there must be no other yet]
    #[arg(long = "truth", value_name = "FILE")]
    save_truth: Option<PathBuf>,
    #[command(flatten)]
    recording: RecordingArgs,
}

pub(super) fn run(arguments: &CityArgs, common: &Common, out: &mut impl Write) -> anyhow::Result<Exit> {
    let RecordingArgs { output, truth_rate, seed, .. } = &arguments.recording;
    let recording = CityRecording::new(&CityOptions {
        seed: *seed,
        travel_m: arguments.km * 1000.0,
        revisit_share: arguments.revisit,
        speed_m_s: arguments.speed,
        lidar: arguments.recording.lidar(arguments.beams, arguments.azimuth_steps),
    });
    let recording = recording.map_err(told)?;
    let poses = recording.poses(*truth_rate).map_err(told)?;
    let named = arguments.save_truth.as_deref();
    let truth_path = truth_path(output, named);
    let again = recording.poses(*truth_rate).map_err(told)?;
    refuse_other_truth(&truth_path, named, |out| write_tum_poses(out, again))?;

    let format = OutputFormat::of_name(output)?;
    let log = LogWriter::create(output, format, CompressionArg::ZstdFast)?;
    let progress = Progress::new(common, recording.len());
    let returns = save_scans(recording.scans(), log, &progress)?;
    drop(progress);
    let count = poses.len();
    save(&truth_path, |out| write_tum_poses(out, poses))?;

    let (travel_m, revisited) = recording.travel_and_revisits();
    writeln!(
        out,
        "{}: {}, {}, {:.3} km, {:.0} % of them for the second time",
        output.display(),
        counted(recording.len() as u64, "scan"),
        counted(returns, "return"),
        travel_m / 1000.0,
        revisited * 100.0,
    )?;
    writeln!(out, "{}: {}", truth_path.display(), counted(count as u64, "pose"))?;
    Ok(Exit::Done)
}
