//! Work for casters: the surfels of a map and the rays that are cast into it, as `dmp score` has them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use anyhow::{Context as _, ensure};
use clap::Args;
use dmp::{Config, Run, ScoredReturns, Sink, Watch, evaluate};
use dmp_log::{LogOptions, McapScanWriter, McapWriterOptions, ScanLog, open_log, read_trajectory};
use dmp_map::Store;
use dmp_sensor::{Ray, Trajectory};
use dmp_sim::{LidarOptions, Recording, RecordingOptions, Route};

use super::files::{Files, Work};

/// The scenes of the benchmark and their voxel edges, metres: all from one drive.
const SCENES: [(&str, f64); 3] = [("dense", 0.1), ("city", 0.2), ("coarse", 0.5)];

/// What scenes are made from.
#[derive(Debug, Args)]
pub(super) struct SceneArgs {
    /// Scans of the simulated drive
    #[arg(long, default_value_t = 600, value_parser = clap::value_parser!(u32).range(1..))]
    scans: u32,
    /// Scans whose rays are cast, spread evenly over the drive
    #[arg(long, default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..))]
    cast_scans: u32,
    /// A scene of this log instead of a simulated drive, called log
    #[arg(long, requires = "trajectory", conflicts_with = "scenes")]
    log: Option<PathBuf>,
    /// Its trajectory
    #[arg(short, long, requires = "log")]
    trajectory: Option<PathBuf>,
    /// Voxel edge of its map, metres
    #[arg(long, default_value_t = 0.2, requires = "log")]
    voxel: f64,
}

/// The scenes in a folder; those of the simulated drive and of the log are made where they are missing.
pub(super) fn files(arguments: &SceneArgs, folder: &Path, names: &[String]) -> anyhow::Result<Vec<Files>> {
    let cast_scans = arguments.cast_scans as usize;
    std::fs::create_dir_all(folder).with_context(|| format!("{}: cannot create", folder.display()))?;
    if let (Some(log), Some(trajectory)) = (&arguments.log, &arguments.trajectory) {
        let files = Files::of_scene(folder, "log");
        let log = open_log(log, &LogOptions::default())?;
        let trajectory = read_trajectory(trajectory)?.trajectory;
        scene_of(log.as_ref(), &trajectory, arguments.voxel, cast_scans)?.write(&files)?;
        return Ok(vec![files]);
    }
    let temporary = tempfile::tempdir_in("/var/tmp")?;
    let mut drive = None;
    let mut scenes = Vec::new();
    for name in names {
        let files = Files::of_scene(folder, name);
        if !files.exist() {
            let known = SCENES.iter().find(|(known, _)| known == name);
            let &(_, voxel_m) = known.with_context(|| format!("{}: no such scene", files.rays.display()))?;
            let made = match drive.take() {
                Some(made) => made,
                None => simulated_drive(arguments.scans as usize, temporary.path())?,
            };
            let (log, truth): &(Box<dyn ScanLog>, Trajectory) = drive.insert(made);
            scene_of(log.as_ref(), truth, voxel_m, cast_scans)?.write(&files)?;
        }
        scenes.push(files);
    }
    Ok(scenes)
}

/// The log and truth of a drive of a 64-beam sensor through streets with traffic, ten scans a second at 8 m/s. The folder
/// must live as long as the log.
fn simulated_drive(scans: usize, folder: &Path) -> anyhow::Result<(Box<dyn ScanLog>, Trajectory)> {
    let lidar = LidarOptions { azimuth_steps: 1800, ..LidarOptions::with_beams(64) };
    let options = RecordingOptions { seed: 1, scans, route: Route::Ring, speed_m_s: 8.0, traffic: 20, lidar };
    let town = options.town()?;
    let recording = Recording::new(&town, &options)?;
    let path = folder.join("drive.mcap");
    let mut log = McapScanWriter::create(&path, &McapWriterOptions::default())?;
    for scan in recording.scans() {
        log.write_scan(&scan)?;
    }
    log.finish()?;
    Ok((open_log(&path, &LogOptions::default())?, recording.drive().trajectory(100.0)?))
}

/// Scores the log with its trajectory: the fused map, and the used returns of `cast_scans` scans spread evenly over it.
/// Places are relative to the middle of the map: f32 is exact enough there.
fn scene_of(log: &dyn ScanLog, run: &Trajectory, voxel_m: f64, cast_scans: usize) -> anyhow::Result<Work> {
    let maps = tempfile::tempdir_in("/var/tmp")?;
    let save_maps = Some(maps.path().to_path_buf());
    let config = Config { voxel_m: Some(voxel_m), save_maps, ..Config::default() };
    let scans = log.frames().len();
    let wanted = (0..cast_scans.min(scans)).map(|k| k * scans / cast_scans.min(scans));
    let kept = Kept { of_frames: Mutex::new(wanted.map(|frame| (frame, Vec::new())).collect()) };
    let report = evaluate(log, &[Run::new("drive", run.clone())], &config, Watch::sink(&kept))?;
    let store = Store::open(&maps.path().join("drive.dmpmap"))?;
    let origin = origin_of(&store).context("the map is empty")?;
    let mut work = Work::default();
    let radius_m = store.lattice().disc_radius_m() as f32;
    let mut tiles: Vec<_> = store.entries().map(|entry| entry.tile).collect();
    tiles.sort_unstable();
    for id in tiles {
        let Some(tile) = store.load(id)? else { continue };
        for surfel in &tile.surfels[..tile.own] {
            let centre = |k: usize| {
                (tile.origin_in_world_m[k] + f64::from(surfel.centre_in_tile_m[k]) - origin[k]) as f32
            };
            let [nx, ny, nz] = surfel.normal;
            work.surfels.push([centre(0), centre(1), centre(2), nx, ny, nz, radius_m]);
            work.support.push([surfel.third_lowest, surfel.third_highest]);
        }
    }
    let starts = &report.inputs.runs[0].segments.starts_scan;
    for (frame, rays) in kept.of_frames.into_inner().unwrap_or_else(PoisonError::into_inner) {
        let segment = starts.partition_point(|&start| start <= frame) as i32 - 1;
        for ray in &rays {
            let place = |k: usize| (ray.origin_in_world[k] - origin[k]) as f32;
            let [dx, dy, dz] = ray.direction_in_world.map(|d| d as f32);
            work.rays.push([place(0), place(1), place(2), dx, dy, dz, ray.range_m as f32]);
            work.segments.push(segment);
        }
    }
    ensure!(!work.rays.is_empty(), "no return of the chosen scans is used");
    Ok(work)
}

/// Rays of some scans, as they were scored.
struct Kept {
    of_frames: Mutex<BTreeMap<usize, Vec<Ray>>>,
}

impl Sink for Kept {
    fn returns_scored(&self, returns: &ScoredReturns<'_>) {
        let mut of_frames = self.of_frames.lock().unwrap_or_else(PoisonError::into_inner);
        if let (Some(kept), [Some(run)]) = (of_frames.get_mut(&returns.frame), returns.runs) {
            kept.extend_from_slice(run.rays);
        }
    }
}

/// The whole metres nearest to the middle of the map.
fn origin_of(store: &Store) -> Option<[f64; 3]> {
    let [low, high] = store.bounds()?;
    let edge_m = store.lattice().tile_edge_m();
    let [low, high] = [low, high].map(|tile| store.lattice().tile_corner_m(tile));
    let middle = |k: usize| f64::midpoint(low[k], high[k] + edge_m).round();
    let low_z_m = store.entries().map(|entry| entry.extent.z_range_m[0]).fold(f64::INFINITY, f64::min);
    Some([middle(0), middle(1), low_z_m.round()])
}
