//! What the simulated drives have in common: the sensor, and how its scans and the truth are saved.

use std::path::{Path, PathBuf};
use std::sync::mpsc::sync_channel;
use std::{fs, io};

use clap::{Args, ValueEnum};
use dmp_sensor::Scan;
use dmp_sim::{LidarOptions, NoReturn, Sweep};

use super::progress::Progress;
use crate::log_writer::LogWriter;
use crate::parse;
use crate::save::refuse_other;

/// Scans that wait to be written, at most.
const WAITING: usize = 4;

#[derive(Debug, Args)]
pub(super) struct RecordingArgs {
    /// The log: FILE.mcap, or a FOLDER/ of KITTI scans (.bin) with times
    #[arg(short, long, value_name = "LOG")]
    pub(super) output: PathBuf,
    /// Poses of the true trajectory per second, Hz
    #[arg(long, default_value_t = 20.0, value_name = "HZ")]
    pub(super) truth_rate: f64,
    /// Another number makes another place, another drive, other noise
    #[arg(long, default_value_t = 1)]
    pub(super) seed: u64,
    /// Elevation of the lowest and highest beam, degrees [default: -15,15; -25,15 for more than 16 beams]
    #[arg(long, value_name = "LOW,HIGH", allow_hyphen_values = true, value_parser = parse::elevations_rad)]
    elevation: Option<[f64; 2]>,
    /// Turns per second, Hz; every turn is a scan
    #[arg(long, default_value_t = 10.0, value_name = "HZ")]
    rate: f64,
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
enum NoReturnArg {
    /// Nothing
    Omit,
    /// The point (0, 0, 0)
    Zero,
    /// A point of NaNs
    Nan,
}

impl RecordingArgs {
    pub(super) fn lidar(&self, beams: usize, azimuth_steps: usize) -> LidarOptions {
        let common = LidarOptions::with_beams(beams);
        LidarOptions {
            elevation_rad: self.elevation.unwrap_or(common.elevation_rad),
            azimuth_steps,
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
        }
    }
}

/// Where the truth goes: beside the log where no place is named.
pub(super) fn truth_path(log: &Path, named: Option<&Path>) -> PathBuf {
    named.map_or_else(|| log.with_extension("truth.tum"), Path::to_path_buf)
}

/// Refuses to replace a file that the user has not named by another truth, as `write` gives it.
pub(super) fn refuse_other_truth(
    path: &Path,
    named: Option<&Path>,
    write: impl FnOnce(&mut Vec<u8>) -> io::Result<()>,
) -> anyhow::Result<()> {
    // A link is something, wherever it leads.
    if named.is_some()
        || fs::symlink_metadata(path).is_err_and(|error| error.kind() == io::ErrorKind::NotFound)
    {
        return Ok(());
    }
    let mut truth = Vec::new();
    write(&mut truth)?;
    refuse_other(path, &truth)
}

/// Writes scans in order while the next ones are measured; the number of their returns. On an error, or where
/// somebody asks to stop, no more are measured than wait already.
pub(super) fn save_scans(
    scans: impl Iterator<Item = Scan> + Send,
    mut log: LogWriter,
    progress: &Progress,
) -> anyhow::Result<u64> {
    let (sender, measured) = sync_channel(WAITING);
    let mut returns = 0;
    std::thread::scope(|scope| {
        scope.spawn(move || {
            for scan in scans {
                if sender.send(scan).is_err() {
                    return;
                }
            }
        });
        for scan in measured {
            returns += scan.len() as u64;
            log.write(&scan)?;
            progress.written(&scan);
            progress.go_on()?;
        }
        anyhow::Ok(())
    })?;
    log.finish()?;
    Ok(returns)
}
