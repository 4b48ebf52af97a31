//! Files of every writer, for other software to read back.

mod residuals;

use std::fs::{self, File};
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use clap::Args;
use dmp_log::{
    FolderFormat, FolderScanWriter, McapCompression, McapScanWriter, McapWriterOptions, write_euroc,
    write_kitti, write_times, write_tum,
};
use dmp_map::{Durability, FuseBuffers, Lattice, MapFuser, Origin, Store, Surfel};
use dmp_sensor::{Isometry3, Scan, Trajectory, Vector3};
use dmp_sim::{LidarOptions, Recording, RecordingOptions, Route};
use serde_json::{Value, json};

/// Write a file in every format that dmp writes, with a manifest of what is in it
///
/// `tests/conformance/read_back.py FOLDER` reads them with other software and compares.
#[derive(Debug, Args)]
pub(crate) struct WrittenArgs {
    /// The folder, which must not be there yet
    #[arg(value_name = "FOLDER")]
    folder: PathBuf,
}

pub(crate) fn run(arguments: &WrittenArgs) -> anyhow::Result<()> {
    let folder = &arguments.folder;
    fs::create_dir(folder).with_context(|| format!("{}: cannot make the folder", folder.display()))?;
    let lidar = LidarOptions { azimuth_steps: 30, rate_hz: 10.0, ..LidarOptions::with_beams(8) };
    let options =
        RecordingOptions { seed: 3, scans: 4, route: Route::Loop, speed_m_s: 8.0, traffic: 0, lidar };
    let town = options.town()?;
    let recording = Recording::new(&town, &options)?;
    let scans: Vec<Scan> = recording.scans().collect();
    let trajectory = recording.drive().trajectory(50.0)?;
    let mut files = trajectories(folder, &trajectory)?;
    files.extend(logs(folder, &scans)?);
    // LAS rounds to a step of 0.1 mm.
    for (format, tolerance_m) in [
        (FolderFormat::Bin, 0.0),
        (FolderFormat::Pcd, 0.0),
        (FolderFormat::Ply, 0.0),
        (FolderFormat::Las, 0.501e-4),
        (FolderFormat::Laz, 0.501e-4),
    ] {
        files.extend(folder_of_scans(folder, format, tolerance_m, &scans)?);
    }
    files.push(map(folder, &scans)?);
    files.extend(residuals::write(folder, &scans)?);
    let manifest = serde_json::to_string(&json!({ "files": files }))?;
    Ok(fs::write(folder.join("manifest.json"), manifest)?)
}

fn trajectories(folder: &Path, trajectory: &Trajectory) -> anyhow::Result<Vec<Value>> {
    let create = |name: &str| Ok::<_, std::io::Error>(BufWriter::new(File::create(folder.join(name))?));
    write_tum(&mut create("run.tum")?, trajectory)?;
    write_euroc(&mut create("run.csv")?, trajectory)?;
    write_kitti(&mut create("run_kitti.txt")?, trajectory)?;
    let stamps_ns = trajectory.stamps_ns().context("a drive has stamps")?;
    write_times(&mut create("times.txt")?, stamps_ns)?;
    let pose = |pose: &dmp_sensor::Isometry3<f64>| {
        let (t, q) = (pose.translation.vector, pose.rotation.coords);
        [t.x, t.y, t.z, q.x, q.y, q.z, q.w]
    };
    let poses: Vec<[f64; 7]> = trajectory.poses().iter().map(pose).collect();
    let entry = |path: &str, kind: &str| {
        json!({ "path": path, "kind": kind, "poses": poses, "stamps_ns": stamps_ns, "times_file": "times.txt",
                "tolerance_m": 1e-12 })
    };
    Ok(vec![entry("run.tum", "tum"), entry("run.csv", "euroc"), entry("run_kitti.txt", "kitti")])
}

fn logs(folder: &Path, scans: &[Scan]) -> anyhow::Result<Vec<Value>> {
    let kinds = [
        ("zstd.mcap", McapCompression::Zstd),
        ("lz4.mcap", McapCompression::Lz4),
        ("none.mcap", McapCompression::None),
    ];
    let mut files = Vec::new();
    for (name, compression) in kinds {
        let options = McapWriterOptions { compression, ..McapWriterOptions::default() };
        let mut writer = McapScanWriter::create(&folder.join(name), &options)?;
        scans.iter().try_for_each(|scan| writer.write_scan(scan))?;
        writer.finish()?;
        files.push(
            json!({ "path": name, "kind": "mcap", "scans": scans.iter().map(scan_json).collect::<Vec<_>>() }),
        );
    }
    Ok(files)
}

/// A scan in the manifest.
fn scan_json(scan: &Scan) -> Value {
    json!({ "stamp_ns": scan.stamp_ns, "points": scan.points_in_sensor_m, "offsets_ns": scan.time_offsets_ns })
}

/// A map of two scans around a corner of tiles, the first seen in no known segment. Every return is there four times,
/// some centimetres apart, so that few returns make a map.
fn map(folder: &Path, scans: &[Scan]) -> anyhow::Result<Value> {
    let fuser = MapFuser::new(Lattice::new(0.5)?, usize::MAX, folder)?;
    for (k, scan) in (0..2).zip(scans) {
        let segment = (k > 0).then_some(k);
        for turn in 0..4 {
            let place = |point: &[f32; 3]| {
                let [x, y, z] = point.map(f64::from);
                let [a, b, c] = [turn, turn * turn % 4, turn * 3 % 4].map(|n| 0.05 * f64::from(n));
                [x - 1.0 + 2.0 * f64::from(k) + a, y - 1.0 + b, z + 500.0 + c]
            };
            let points: Vec<[f64; 3]> = scan.points_in_sensor_m.iter().map(place).collect();
            fuser.add(&points, segment, &mut FuseBuffers::default())?;
        }
    }
    let path = folder.join("map.dmpmap");
    let frame = Isometry3::new(Vector3::new(431_000.5, -20.25, 3.0), Vector3::new(0.1, -0.2, 0.7));
    let origin = Origin { text: "two scans".to_owned(), own_from_world: frame };
    fuser.finish(&path, &origin, Durability::Temporary, &|_, _| ())?;
    let store = Store::open(&path)?;
    let mut entries: Vec<_> = store.entries().collect();
    entries.sort_unstable_by_key(|entry| entry.tile);
    let mut tiles = Vec::new();
    for entry in entries {
        let tile = store.load(entry.tile)?.context("a tile of the directory")?;
        let row = |surfel: &Surfel| {
            let ([x, y, z], [nx, ny, nz]) = (surfel.centre_in_tile_m, surfel.normal);
            json!([x, y, z, nx, ny, nz, surfel.third_lowest, surfel.third_highest])
        };
        tiles.push(json!({
            "x": tile.id.x, "y": tile.id.y, "origin_in_world_m": tile.origin_in_world_m,
            "z_range_m": entry.extent.z_range_m, "min_third_lowest": entry.extent.min_third_lowest,
            "max_third_highest": entry.extent.max_third_highest, "own": tile.own,
            "surfels": tile.surfels.iter().map(row).collect::<Vec<_>>(),
        }));
    }
    Ok(json!({ "path": "map.dmpmap", "kind": "store", "tiles": tiles }))
}

fn folder_of_scans(
    folder: &Path,
    format: FolderFormat,
    tolerance_m: f64,
    scans: &[Scan],
) -> anyhow::Result<Vec<Value>> {
    let extension = format.extension();
    let mut writer = FolderScanWriter::create(&folder.join(extension), format)?;
    scans.iter().try_for_each(|scan| writer.write_scan(scan))?;
    writer.finish()?;
    if format == FolderFormat::Bin {
        let scans: Vec<Value> = scans.iter().map(scan_json).collect();
        return Ok(vec![json!({ "path": "bin", "kind": "bin", "scans": scans })]);
    }
    let file = |(number, scan): (usize, &Scan)| {
        let offsets_ns = &scan.time_offsets_ns;
        let time = if matches!(format, FolderFormat::Pcd | FolderFormat::Ply) {
            json!({ "name": "t", "values": offsets_ns })
        } else {
            let seconds: Vec<f64> = offsets_ns.iter().map(|&ns| ns as f64 / 1e9).collect();
            json!({ "name": "gps_time", "values": seconds })
        };
        json!({ "path": format!("{extension}/scans/{number:06}.{extension}"), "kind": extension,
                "points": scan.points_in_sensor_m, "time": time, "tolerance_m": tolerance_m })
    };
    Ok(scans.iter().enumerate().map(file).collect())
}
