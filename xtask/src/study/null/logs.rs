//! The logs at hand: simulated drives and rooms, and the real recordings where `DMP_DATA` says they are.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, ensure};
use dmp::Scales;
use dmp_log::{LogOptions, ScanLog, open_log, read_trajectory};
use dmp_sensor::Trajectory;
use dmp_sim::{LidarOptions, Recording, RecordingOptions, Route};

use super::super::drives::{DriveSpec, drives};
use super::super::logs::write_log;
use super::super::rooms::room;

/// Poses of a true trajectory in a second: no error of interpolation shows between them.
const TRUTH_HZ: f64 = 200.0;
/// Sweeps of the short drive, which all see the same surfaces.
const SHORT_SWEEPS: usize = 20;
const ROOMS: [u64; 2] = [1, 2];
const REAL: [(&str, &str); 2] =
    [("nclt_revisit", "poses_lidar_odometry.txt"), ("rs32_static", "poses_icp_odom.txt")];

/// A log with a trajectory that is as right as can be.
pub(super) struct NullLog {
    pub(super) name: String,
    pub(super) log: Box<dyn ScanLog>,
    pub(super) base: Trajectory,
    pub(super) scales: Scales,
    /// Time from scan to scan.
    pub(super) period_ns: i64,
}

/// Those that are wanted, or all.
pub(super) fn names(wanted: &[String]) -> anyhow::Result<Vec<String>> {
    let mut all: Vec<String> = drives().iter().map(|drive| drive.name.to_owned()).collect();
    all.push("short-64".to_owned());
    all.extend(ROOMS.map(|seed| format!("room-{seed}")));
    all.extend(REAL.map(|(name, _)| name.to_owned()));
    for name in wanted {
        ensure!(all.contains(name), "{name}: no such log; they are {}", all.join(", "));
    }
    Ok(if wanted.is_empty() { all } else { wanted.to_vec() })
}

impl NullLog {
    /// Opens a log, or makes it; `None` for a real one that is not at hand.
    pub(super) fn open(name: &str, work: &Path) -> anyhow::Result<Option<Self>> {
        if let Some((folder, trajectory)) = REAL.iter().find(|real| real.0 == name) {
            return real(folder, trajectory);
        }
        if let Some(seed) = name.strip_prefix("room-") {
            let (log, mut runs) = room(seed.parse()?, &work.join("rooms"))?;
            let base = runs.swap_remove(0).trajectory;
            let period_ns = log.summary().period_ns.context("a simulated log has stamps")?;
            let (name, scales) = (name.to_owned(), Scales::Room);
            return Ok(Some(Self { name, log, base, scales, period_ns }));
        }
        let drive = drives().into_iter().find(|drive| drive.name == name);
        let options = drive.map_or_else(short, |drive: DriveSpec| drive.options);
        let town = options.town()?;
        let recording = Recording::new(&town, &options)?;
        let path = work.join(format!("{name}.mcap"));
        write_log(&recording, &path)?;
        Ok(Some(Self {
            name: name.to_owned(),
            log: open_log(&path, &LogOptions::default())?,
            base: recording.drive().trajectory(TRUTH_HZ)?,
            scales: Scales::Drive,
            period_ns: (1e9 / options.lidar.rate_hz).round() as i64,
        }))
    }
}

/// Twenty dense sweeps, a metre apart.
fn short() -> RecordingOptions {
    let lidar = LidarOptions { azimuth_steps: 1800, ..LidarOptions::with_beams(64) };
    let (route, speed_m_s) = (Route::OneWay, 10.0);
    RecordingOptions { seed: 31, scans: SHORT_SWEEPS, route, speed_m_s, traffic: 0, lidar }
}

fn real(folder: &str, trajectory: &str) -> anyhow::Result<Option<NullLog>> {
    let Some(data) = std::env::var_os("DMP_DATA") else {
        eprintln!("{folder}: skipped, for DMP_DATA does not say where the recordings are");
        return Ok(None);
    };
    let path = PathBuf::from(data).join(folder);
    let log = open_log(&path, &LogOptions::default())?;
    let base = read_trajectory(&path.join(trajectory))?.trajectory;
    let stamps = base.stamps_ns().context("the trajectories of the recordings have stamps")?;
    // A pose a scan, line by line.
    let period_ns = (stamps[stamps.len() - 1] - stamps[0]) / stamps.len() as i64;
    let (name, scales) = (folder.to_owned(), Scales::Drive);
    Ok(Some(NullLog { name, log, base, scales, period_ns }))
}
