//! Work for casters: the surfels of a map and the rays that are cast into it, as the score has them.

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

use super::files::Files;
use super::records::{Record, write_numbers, write_records};

/// The scenes of the benchmark and their voxel edges, metres: all from one drive.
pub(in crate::bench) const SCENES: [(&str, f64); 3] = [("dense", 0.1), ("city", 0.2), ("coarse", 0.5)];

/// What scenes are made of.
#[derive(Debug, Args)]
pub(super) struct SceneArgs {
    /// Scans of the simulated drive
    #[arg(long, default_value_t = 600, value_parser = clap::value_parser!(u32).range(1..))]
    scans: u32,
    /// Scans whose rays are cast, spread evenly over the drive
    #[arg(long, default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..))]
    cast_scans: u32,
    /// A scene of this log instead of a simulated drive
    #[arg(long, requires = "trajectory", conflicts_with = "scenes")]
    log: Option<PathBuf>,
    /// Its trajectory
    #[arg(short, long, requires = "log")]
    trajectory: Option<PathBuf>,
    /// Name of its scene
    #[arg(long, default_value = "log", requires = "log")]
    name: String,
    /// Voxel edge of its map, metres
    #[arg(long, default_value_t = 0.2, requires = "log")]
    voxel: f64,
}

/// The scenes in a folder; those of the simulated drive and of the log are made where they are not there.
///
/// # Errors
/// When a scene is none of these.
pub(super) fn files(arguments: &SceneArgs, folder: &Path, names: &[String]) -> anyhow::Result<Vec<Files>> {
    let cast_scans = arguments.cast_scans as usize;
    std::fs::create_dir_all(folder)
        .with_context(|| format!("{}: cannot make the folder", folder.display()))?;
    let make = |files: &Files, scene: Scene| -> anyhow::Result<()> {
        scene.write(files)?;
        println!("{}: {}", files.name, scene.told());
        Ok(())
    };
    if let (Some(log), Some(trajectory)) = (&arguments.log, &arguments.trajectory) {
        let files = Files::of_scene(folder, &arguments.name);
        let log = open_log(log, &LogOptions::default())?;
        let trajectory = read_trajectory(trajectory)?.trajectory;
        make(&files, Scene::of_log(log.as_ref(), trajectory, arguments.voxel, cast_scans)?)?;
        return Ok(vec![files]);
    }
    let work = tempfile::tempdir_in("/var/tmp")?;
    let mut drive = None;
    let mut scenes = Vec::new();
    for name in names {
        let files = Files::of_scene(folder, name);
        if !files.are_there() {
            let known = SCENES.iter().find(|(known, _)| known == name);
            let &(_, voxel_m) = known.with_context(|| format!("{}: no such scene", files.rays.display()))?;
            if drive.is_none() {
                drive = Some(SimulatedDrive::new(arguments.scans as usize, work.path())?);
            }
            if let Some(drive) = &drive {
                make(&files, drive.scene(voxel_m, cast_scans)?)?;
            }
        }
        scenes.push(files);
    }
    Ok(scenes)
}

/// A drive of a 64-beam sensor through streets with traffic, ten scans a second at 8 m/s.
pub(in crate::bench) struct SimulatedDrive {
    pub(in crate::bench) log: Box<dyn ScanLog>,
    pub(in crate::bench) truth: Trajectory,
}

impl SimulatedDrive {
    /// Simulates the drive and writes its log into a folder, which must live as long as this.
    pub(in crate::bench) fn new(scans: usize, folder: &Path) -> anyhow::Result<Self> {
        let lidar = LidarOptions { azimuth_steps: 1800, ..LidarOptions::with_beams(64) };
        let options =
            RecordingOptions { seed: 1, scans, route: Route::Ring, speed_m_s: 8.0, traffic: 20, lidar };
        let town = options.town()?;
        let recording = Recording::new(&town, &options)?;
        let path = folder.join("drive.mcap");
        let mut log = McapScanWriter::create(&path, &McapWriterOptions::default())?;
        for scan in recording.scans() {
            log.write_scan(&scan)?;
        }
        log.finish()?;
        Ok(Self {
            log: open_log(&path, &LogOptions::default())?,
            truth: recording.drive().trajectory(100.0)?,
        })
    }

    /// The drive's own map at this voxel edge and rays of some of its scans.
    fn scene(&self, voxel_m: f64, cast_scans: usize) -> anyhow::Result<Scene> {
        Scene::of_log(self.log.as_ref(), self.truth.clone(), voxel_m, cast_scans)
    }
}

/// A map and the rays that are cast into it.
#[derive(Debug)]
struct Scene {
    /// What was subtracted from every place, world metres.
    origin_in_world_m: [f64; 3],
    /// Centre, unit normal, radius.
    surfels: Vec<Record>,
    /// Third lowest and third highest segment of each surfel.
    support: Vec<[i32; 2]>,
    /// Origin, unit direction, measured range.
    rays: Vec<Record>,
    /// Segment of each ray.
    segments: Vec<i32>,
}

impl Scene {
    /// Scores the log with its trajectory and keeps what is cast: the fused map, and the used returns of
    /// `cast_scans` scans spread evenly over it.
    fn of_log(
        log: &dyn ScanLog,
        trajectory: Trajectory,
        voxel_m: f64,
        cast_scans: usize,
    ) -> anyhow::Result<Self> {
        let maps = tempfile::tempdir_in("/var/tmp")?;
        let save_maps = Some(maps.path().to_path_buf());
        let config = Config { voxel_m: Some(voxel_m), save_maps, ..Config::default() };
        let scans = log.frames().len();
        let wanted = (0..cast_scans.min(scans)).map(|k| k * scans / cast_scans.min(scans));
        let kept = Kept { of_frames: Mutex::new(wanted.map(|frame| (frame, Vec::new())).collect()) };
        let report = evaluate(log, &[Run::new("drive", trajectory)], &config, Watch::sink(&kept))?;
        let starts = report.config.segments.starts_scan;
        let store = Store::open(&maps.path().join("drive.dmpmap"))?;

        let origin_in_world_m = origin_of(&store).context("the map is empty")?;
        let mut scene = Self {
            origin_in_world_m,
            surfels: Vec::new(),
            support: Vec::new(),
            rays: Vec::new(),
            segments: Vec::new(),
        };
        scene.add_surfels(&store)?;
        for (frame, rays) in kept.of_frames.into_inner().unwrap_or_else(PoisonError::into_inner) {
            scene.add_rays(&rays, segment_of(frame, &starts)?);
        }
        ensure!(!scene.rays.is_empty(), "no return of the chosen scans is used");
        Ok(scene)
    }

    fn add_surfels(&mut self, store: &Store) -> anyhow::Result<()> {
        let radius_m = store.lattice().disc_radius_m() as f32;
        let mut tiles: Vec<_> = store.entries().map(|entry| entry.tile).collect();
        tiles.sort_unstable();
        for id in tiles {
            let Some(tile) = store.load(id)? else { continue };
            for surfel in &tile.surfels[..tile.own] {
                let centre = |k: usize| {
                    let in_world_m = tile.origin_in_world_m[k] + f64::from(surfel.centre_in_tile_m[k]);
                    (in_world_m - self.origin_in_world_m[k]) as f32
                };
                let [nx, ny, nz] = surfel.normal;
                self.surfels.push([centre(0), centre(1), centre(2), nx, ny, nz, radius_m]);
                self.support.push([surfel.third_lowest, surfel.third_highest]);
            }
        }
        Ok(())
    }

    fn add_rays(&mut self, rays: &[Ray], segment: i32) {
        for ray in rays {
            let origin = |k: usize| (ray.origin_in_world[k] - self.origin_in_world_m[k]) as f32;
            let [dx, dy, dz] = ray.direction_in_world.map(|d| d as f32);
            self.rays.push([origin(0), origin(1), origin(2), dx, dy, dz, ray.range_m as f32]);
            self.segments.push(segment);
        }
    }

    /// Writes the files of the scene.
    fn write(&self, files: &Files) -> anyhow::Result<()> {
        write_records(&files.surfels, self.surfels.iter())?;
        write_records(&files.rays, self.rays.iter())?;
        if let Some([support, segments]) = &files.segments {
            write_numbers(support, self.support.iter().flatten().map(|x| x.to_le_bytes()))?;
            write_numbers(segments, self.segments.iter().map(|x| x.to_le_bytes()))?;
        }
        Ok(())
    }

    /// Its size in words.
    fn told(&self) -> String {
        let within = |low: f32, high: f32| {
            let count = self.rays.iter().filter(|ray| ray[6] >= low && ray[6] < high).count();
            format!("{:.1} %", 100.0 * count as f64 / self.rays.len() as f64)
        };
        format!(
            "{} surfels, {} rays ({} under 10 m, {} to 20 m, {} to 50 m, {} beyond), origin {:?}",
            self.surfels.len(),
            self.rays.len(),
            within(0.0, 10.0),
            within(10.0, 20.0),
            within(20.0, 50.0),
            within(50.0, f32::INFINITY),
            self.origin_in_world_m
        )
    }
}

/// Rays of some scans, as they were scored.
struct Kept {
    of_frames: Mutex<BTreeMap<usize, Vec<Ray>>>,
}

impl Sink for Kept {
    fn returns_scored(&self, returns: &ScoredReturns<'_>) {
        let mut of_frames = self.of_frames.lock().unwrap_or_else(PoisonError::into_inner);
        if let (Some(kept), [run]) = (of_frames.get_mut(&returns.frame), returns.runs) {
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

/// The segment of a scan, of the scans with which segments begin.
fn segment_of(frame: usize, starts: &[usize]) -> anyhow::Result<i32> {
    let begun = starts.partition_point(|&start| start <= frame);
    Ok(i32::try_from(begun)? - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scan_is_in_the_segment_that_began_last() {
        let segments: Vec<i32> = (0..6).map(|frame| segment_of(frame, &[0, 2, 5]).unwrap()).collect();
        assert_eq!(segments, [0, 0, 1, 1, 1, 2]);
    }
}
