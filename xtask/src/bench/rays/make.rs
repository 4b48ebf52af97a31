//! A map of a simulated drive and the rays of its returns, as files.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, ensure};
use clap::Args;
use dmp::{Config, Run, fuse_maps};
use dmp_map::Store;
use dmp_sensor::{EgoMask, Isometry3, Ray, ReturnFilter, Scan, Track};

use super::npy;
use crate::bench::cast::scene::SimulatedDrive;

/// What the map and the rays are made of.
#[derive(Debug, Args)]
pub(super) struct SceneArgs {
    /// Scans of the simulated drive, of 64 beams and 1800 columns
    #[arg(long, default_value_t = 600, value_parser = clap::value_parser!(u32).range(1..))]
    scans: u32,
    /// Voxel edge of the map, metres
    #[arg(long, default_value_t = 0.2)]
    voxel: f64,
    /// Rays, millions: the returns of some scans, spread evenly over the drive, in the order of the log
    #[arg(long, default_value_t = 10.0)]
    rays_millions: f64,
}

/// Where the map and the rays are.
#[derive(Debug, Clone)]
pub(super) struct Files {
    pub(super) folder: PathBuf,
    pub(super) map: PathBuf,
    /// N × 3 each, in the frame of the drive's trajectory.
    pub(super) origins: PathBuf,
    pub(super) directions: PathBuf,
    /// What was measured, N.
    pub(super) ranges: PathBuf,
}

/// The run of the drive, and so its map.
const NAME: &str = "drive";

impl Files {
    pub(super) fn of(folder: &Path) -> Self {
        let [map, origins, directions, ranges] =
            ["drive.dmpmap", "origins.npy", "directions.npy", "ranges.npy"].map(|name| folder.join(name));
        Self { folder: folder.to_path_buf(), map, origins, directions, ranges }
    }

    pub(super) fn are_there(&self) -> bool {
        [&self.map, &self.origins, &self.directions, &self.ranges].into_iter().all(|path| path.is_file())
    }
}

/// Writes the files; says what is in them.
pub(super) fn make(arguments: &SceneArgs, files: &Files) -> anyhow::Result<String> {
    std::fs::create_dir_all(&files.folder).with_context(|| files.folder.display().to_string())?;
    let work = tempfile::tempdir_in("/var/tmp")?;
    let drive = SimulatedDrive::new(arguments.scans as usize, work.path())?;
    let save_maps = Some(files.folder.clone());
    let config = Config { voxel_m: Some(arguments.voxel), save_maps, ..Config::default() };
    drop(fuse_maps(drive.log.as_ref(), &[Run::new(NAME, drive.truth.clone())], &config, ())?);
    let wanted = (arguments.rays_millions * 1e6) as usize;
    let rays = rays(&drive, wanted)?;
    npy::write(&files.origins, &rays.iter().map(|ray| ray.origin_in_world).collect::<Vec<_>>())?;
    npy::write(&files.directions, &rays.iter().map(|ray| ray.direction_in_world).collect::<Vec<_>>())?;
    npy::write(&files.ranges, &rays.iter().map(|ray| [ray.range_m]).collect::<Vec<_>>())?;
    let surfels = Store::open(&files.map)?.surfels();
    Ok(format!("{} scans: a map of {surfels} surfels, {} rays", arguments.scans, rays.len()))
}

/// So many rays of returns, of as few scans as have them.
fn rays(drive: &SimulatedDrive, wanted: usize) -> anyhow::Result<Vec<Ray>> {
    let track = Track::new(&drive.truth, Isometry3::identity(), drive.truth.usual_gap_ns());
    let filter = ReturnFilter { min_range_m: 1.5, max_range_m: 100.0, ego: EgoMask::default() };
    let (mut reader, mut scan) = (drive.log.reader()?, Scan::default());
    let mut cursor = track.cursor();
    let scans = drive.log.frames().len();
    let (mut rays, mut of_first) = (Vec::with_capacity(wanted), 0);
    let mut taken = 0;
    // The first scan says about how many are needed; a tenth more, since scans differ.
    let mut needed = scans;
    while rays.len() < wanted && taken < needed {
        reader.read(taken * scans / needed, &mut scan)?;
        let stamp_ns = scan.stamp_ns.context("the log has no stamps")?;
        for (index, &point) in scan.points_in_sensor_m.iter().enumerate() {
            let offset_ns = scan.time_offsets_ns.get(index).copied().unwrap_or(0);
            let pose = cursor.world_from_sensor_at(stamp_ns.saturating_add(offset_ns));
            if let Some(pose) = pose.filter(|_| filter.check(point).is_ok()) {
                rays.push(Ray::of_return(&pose, point));
            }
        }
        if taken == 0 {
            of_first = rays.len();
            needed = (wanted * 11 / 10).checked_div(of_first).map_or(scans, |many| (many + 1).min(scans));
        }
        taken += 1;
    }
    ensure!(
        rays.len() >= wanted,
        "{} rays of {scans} scans, {of_first} of the first; {wanted} are wanted",
        rays.len()
    );
    rays.truncate(wanted);
    Ok(rays)
}
