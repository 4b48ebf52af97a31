//! How fast points are fused, and made into surfels.

use std::path::{Path, PathBuf};

use anyhow::Context as _;
use clap::Args;
use dmp_log::{LogOptions, open_log, read_trajectory};
use dmp_map::{Durability, FuseBuffers, Lattice, MapFuser};
use dmp_sensor::{EgoMask, Isometry3, Ray, ReturnFilter, Scan, Track};

use super::times::{circumstances, on_core_s, spread};

/// Length of the segments that the drive is cut into, metres.
const SEGMENT_M: f64 = 12.0;

/// Fusing the points of a log that are posed beforehand: points a second of one core, and surfels made of them
#[derive(Debug, Args)]
pub(crate) struct FuseArgs {
    /// The log
    log: PathBuf,
    /// Where the sensor was: stamped poses of the sensor itself
    #[arg(long)]
    trajectory: PathBuf,
    /// Points that are fused, millions: the log's first ones. Each takes 24 bytes of memory
    #[arg(long, default_value_t = 40)]
    points_millions: usize,
    /// Voxel edge, metres
    #[arg(long, default_value_t = 0.2)]
    voxel: f64,
    /// How often they are fused
    #[arg(long, default_value_t = 7, value_parser = clap::value_parser!(u32).range(5..))]
    runs: u32,
}

/// A scan's points in the world, metres, and the segment of the drive it was made in.
struct PosedScan {
    points_in_world_m: Vec<[f64; 3]>,
    segment: i32,
}

/// What one fusion took on the core, and what came of it.
struct Taken {
    add_s: f64,
    finish_s: f64,
    surfels: u64,
    voxels: u64,
}

pub(crate) fn run(arguments: &FuseArgs) -> anyhow::Result<()> {
    let scans = posed(&arguments.log, &arguments.trajectory, arguments.points_millions * 1_000_000)?;
    let points: usize = scans.iter().map(|scan| scan.points_in_world_m.len()).sum();
    anyhow::ensure!(points > 0, "{}: no point has a pose", arguments.log.display());
    // Surfels are made by a pool: of one thread, whose time is looked at.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let runs = (0..arguments.runs).map(|_| pool.install(|| fuse(&scans, arguments.voxel)));
    let taken = runs.collect::<anyhow::Result<Vec<_>>>()?;
    let last = taken.last().context("no run")?;
    println!(
        "{} scans, {points} points, voxel {} m: {} voxels, {} surfels",
        scans.len(),
        arguments.voxel,
        last.voxels,
        last.surfels
    );
    println!("one thread, its time on the core, {} runs; {}", arguments.runs, circumstances());
    println!("{:<10}{:>14}{:>12}{:>24}", "stage", "M a second", "ns each", "least – largest ns");
    for (stage, seconds, count) in [
        ("add", (|one| one.add_s) as fn(&Taken) -> f64, points as f64),
        ("finish", |one| one.finish_s, last.surfels as f64),
    ] {
        let [ns, least, largest] = spread(taken.iter().map(|one| seconds(one) / count * 1e9).collect());
        println!("{stage:<10}{:>14.1}{ns:>12.1}{:>24}", 1e3 / ns, format!("{least:.1} – {largest:.1}"));
    }
    println!("add: of points; finish: of surfels, the store written");
    Ok(())
}

fn fuse(scans: &[PosedScan], voxel_m: f64) -> anyhow::Result<Taken> {
    let folder = tempfile::tempdir_in("/var/tmp")?;
    let start_s = on_core_s()?;
    let fuser = MapFuser::new(Lattice::new(voxel_m)?, usize::MAX, folder.path())?;
    let mut buffers = FuseBuffers::default();
    for scan in scans {
        fuser.add(&scan.points_in_world_m, Some(scan.segment), &mut buffers)?;
    }
    let added_s = on_core_s()?;
    let path = folder.path().join("fused.dmpmap");
    let summary =
        fuser.finish(&path, &dmp_map::Origin::of("benchmark"), Durability::Temporary, &|_, _| ())?;
    let finish_s = on_core_s()? - added_s;
    let (surfels, voxels) = (summary.surfels, summary.surfels + summary.thin_voxels);
    Ok(Taken { add_s: added_s - start_s, finish_s, surfels, voxels })
}

/// The log's first points that are returns and have a pose.
fn posed(log: &Path, trajectory: &Path, most_points: usize) -> anyhow::Result<Vec<PosedScan>> {
    let log = open_log(log, &LogOptions::default())?;
    let trajectory = read_trajectory(trajectory)?.trajectory;
    let track = Track::new(&trajectory, Isometry3::identity(), trajectory.usual_gap_ns());
    let filter = ReturnFilter { min_range_m: 1.5, max_range_m: 100.0, ego: EgoMask::default() };
    let (mut reader, mut scan) = (log.reader()?, Scan::default());
    let mut cursor = track.cursor();
    let (mut scans, mut points) = (Vec::new(), 0);
    let (mut travel_m, mut place): (f64, Option<Isometry3<f64>>) = (0.0, None);
    for frame in 0..log.frames().len() {
        if points >= most_points {
            break;
        }
        reader.read(frame, &mut scan)?;
        let stamp_ns = scan.stamp_ns.context("the log has no stamps")?;
        let mut points_in_world_m = Vec::new();
        for (index, &point) in scan.points_in_sensor_m.iter().enumerate() {
            let offset_ns = scan.time_offsets_ns.get(index).copied().unwrap_or(0);
            let Some(pose) = cursor.world_from_sensor_at(stamp_ns.saturating_add(offset_ns)) else {
                continue;
            };
            if filter.check(point).is_ok() {
                points_in_world_m.push(Ray::of_return(&pose, point).endpoint_in_world());
            }
        }
        if let Some(here) = cursor.world_from_sensor_at(stamp_ns) {
            let step = |before: Isometry3<f64>| (here.translation.vector - before.translation.vector).norm();
            travel_m += place.map_or(0.0, step);
            place = Some(here);
        }
        points += points_in_world_m.len();
        scans.push(PosedScan { points_in_world_m, segment: (travel_m / SEGMENT_M) as i32 });
    }
    Ok(scans)
}
