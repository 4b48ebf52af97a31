//! What the simulated drives have in common: the sensor, and how its scans and the truth are saved.

use std::path::{Path, PathBuf};
use std::sync::mpsc::sync_channel;
use std::{fs, io};

use dmp_sensor::{Scan, Trajectory};
use dmp_sim::{LidarOptions, Sweep};

use crate::console::{Common, Progress};
use crate::files::{LogWriter, refuse_other};
use crate::options::{Asked, simulate};

/// Scans that wait to be written, at most.
const WAITING: usize = 4;
/// Poses of the true trajectory per second.
pub(super) const TRUTH_RATE_HZ: f64 = 20.0;

/// The sensor, with these numbers where none are given.
pub(super) fn lidar(asked: &Asked, beams: usize, azimuth_steps: usize) -> LidarOptions {
    let usual = LidarOptions::with_beams(asked.get(&simulate::BEAMS).unwrap_or(beams));
    LidarOptions {
        elevation_rad: asked.get(&simulate::ELEVATION).unwrap_or(usual.elevation_rad),
        azimuth_steps: asked.get(&simulate::AZIMUTH_STEPS).unwrap_or(azimuth_steps),
        rate_hz: asked.get(&simulate::RATE).unwrap_or(usual.rate_hz),
        max_range_m: asked.get(&simulate::FARTHEST).unwrap_or(usual.max_range_m),
        range_noise_m: asked.get(&simulate::RANGE_NOISE).unwrap_or(usual.range_noise_m),
        drop_out: asked.get(&simulate::DROP_OUT).unwrap_or(usual.drop_out),
        resolution_m: asked.get(&simulate::RESOLUTION).unwrap_or(usual.resolution_m),
        no_return: asked.get(&simulate::NO_RETURN).unwrap_or_default(),
        sweep: if asked.has(&simulate::INSTANT) { Sweep::Instant } else { Sweep::Spinning },
        ..usual
    }
}

/// Path length from pose to pose, metres.
pub(super) fn travel_m(run: &Trajectory) -> f64 {
    let steps = run.poses().windows(2).map(|pair| pair[1].translation.vector - pair[0].translation.vector);
    steps.map(|step| step.norm()).sum()
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
    total: usize,
    mut log: LogWriter,
    common: &Common,
) -> anyhow::Result<u64> {
    let progress = Progress::new(common);
    progress.scans("simulating", total as u64);
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
            progress.one_scan();
            common.host.go_on()?;
        }
        anyhow::Ok(())
    })?;
    log.finish()?;
    Ok(returns)
}
