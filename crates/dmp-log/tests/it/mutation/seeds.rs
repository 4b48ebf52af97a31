//! Good files: of the project's own writers, and of other software (`tests/conformance`).

use crate::common::{Message, POINTS, scans, write_mcap, write_with};
use crate::las_log::WorldFile;
use crate::topics::{ODOMETRY, PATH, TF, TF_STATIC, odometry, path as path_of, transforms};
use dmp_log::{FolderFormat, FolderScanWriter, McapCompression};
use dmp_sensor::{Isometry3, Point3};
use std::fs;
use std::path::{Path, PathBuf};

fn folder_of_others() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/conformance")
}

pub(super) fn of_others(name: &str) -> Vec<u8> {
    fs::read(folder_of_others().join(name)).unwrap()
}

fn chosen(folder: &str, choose: impl Fn(&str) -> bool) -> Vec<Vec<u8>> {
    let entries = fs::read_dir(folder_of_others().join(folder)).unwrap();
    let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let mut names: Vec<String> = names.filter(|name| choose(name)).collect();
    names.sort();
    assert!(!names.is_empty());
    names.iter().map(|name| of_others(&format!("{folder}/{name}"))).collect()
}

pub(super) fn clouds_of_others(choose: impl Fn(&str) -> bool) -> Vec<Vec<u8>> {
    chosen("clouds", choose)
}

/// Meshes in `text`, `little` or `big` PLY, or in `obj`.
pub(super) fn meshes_of_others(kind: &str) -> Vec<Vec<u8>> {
    let ending = match kind {
        "text" => "ascii.ply",
        "little" => "binary.ply",
        "big" => "big.ply",
        _ => ".obj",
    };
    let mut all = chosen("clouds", |name| name.starts_with("mesh") && name.ends_with(ending));
    if kind != "big" {
        all.extend(chosen("mesh", |name| name.ends_with(ending)));
    }
    all
}

/// What `write` puts at a path.
fn written(name: &str, write: impl FnOnce(&Path)) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    write(&path);
    fs::read(path).unwrap()
}

pub(super) fn own_mcap(compression: McapCompression) -> Vec<Vec<u8>> {
    vec![written("log.mcap", |path| write_mcap(path, &scans(6, 100, true), compression))]
}

/// So that the damage reaches the parsers behind.
fn no_checksums() -> mcap::WriteOptions {
    mcap::WriteOptions::new()
        .calculate_chunk_crcs(false)
        .calculate_data_section_crc(false)
        .calculate_summary_section_crc(false)
}

pub(super) fn without_checksums() -> Vec<Vec<u8>> {
    let message = Message::of(&[[1.0, 2.0, 3.0]; 8]).encode();
    let messages: Vec<_> = (0..4).map(|_| (0, message.clone())).collect();
    let packed = [None, Some(mcap::Compression::Zstd), Some(mcap::Compression::Lz4)];
    let ways = packed.into_iter().flat_map(|compression| [(compression, true), (compression, false)]);
    ways.map(|(compression, chunked)| {
        let options = no_checksums().compression(compression).use_chunks(chunked);
        written("log.mcap", |path| write_with(path, options, &[POINTS], &messages))
    })
    .collect()
}

pub(super) fn log_with_poses() -> Vec<u8> {
    let still = Isometry3::translation(1.0, 2.0, 3.0);
    let frames =
        transforms(&[(0, "map", "base", still), (100, "map", "base", still), (0, "base", "lidar", still)]);
    let messages = [
        (0, Message::of(&[[1.0, 2.0, 3.0]; 8]).encode()),
        (1, odometry(1000, [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])),
        (2, path_of(&[(1000, 0.0), (1100, 1.0)])),
        (3, frames.clone()),
        (4, frames),
    ];
    let options = no_checksums().compression(None);
    written("log.mcap", |path| write_with(path, options, &[POINTS, ODOMETRY, PATH, TF, TF_STATIC], &messages))
}

/// The messages of a type in all logs of other software, no larger ones than are quickly read.
pub(super) fn messages(kind: &str) -> Vec<Vec<u8>> {
    let mut found = Vec::new();
    for log in chosen("mcap", |name| {
        name.split_once('.').is_some_and(|(log, kind)| kind == "mcap" && !log.contains("velodyne"))
    }) {
        for message in mcap::MessageStream::new(&log).unwrap() {
            let message = message.unwrap();
            let name = message.channel.schema.as_ref().map(|schema| schema.name.clone()).unwrap_or_default();
            if name.rsplit('/').next() == Some(kind) {
                found.push(message.data.into_owned());
            }
        }
    }
    found.dedup();
    found.truncate(40);
    found
}

/// One of gtsam's, and one without information that has a loop.
pub(super) fn pose_graphs() -> Vec<Vec<u8>> {
    let vertex = |id| format!("VERTEX_SE3:QUAT {id} {id}.5 -2e1 0 0 0 0.6 0.8\n");
    let edge = |id| format!("EDGE_SE3:QUAT {id} {} 1 0 0.25 0 0 0 1\r\n", (id + 1) % 5);
    let own: String = (0..5).map(|id| vertex(id) + &edge(id)).collect();
    vec![of_others("trajectories/gtsam.g2o"), format!("# a loop\nFIX 0\n{own}").into_bytes()]
}

/// With ids in any order, without, and as a trajectory.
pub(super) fn keyframe_times() -> Vec<Vec<u8>> {
    let with_ids = "id stamp\n7 1.75\n-2 0.5\n3,1.000000001\n".into();
    vec![with_ids, of_others("trajectories/times.txt"), of_others("trajectories/evo.tum")]
}

/// Little-endian and without padding.
#[derive(Default)]
struct Ros1(Vec<u8>);

impl Ros1 {
    fn u32(mut self, value: u32) -> Self {
        self.0.extend(value.to_le_bytes());
        self
    }

    fn bytes(mut self, bytes: &[u8]) -> Self {
        self.0.extend(bytes);
        self
    }

    fn counted(self, bytes: &[u8]) -> Self {
        self.u32(bytes.len() as u32).bytes(bytes)
    }

    fn header(frame: &str) -> Self {
        Self::default().u32(3).u32(1_690_309_709).u32(5).counted(frame.as_bytes())
    }
}

pub(super) fn ros1_point_cloud2() -> Vec<u8> {
    let data: Vec<u8> = (0..24).flat_map(|k| (k as f32).to_le_bytes()).collect();
    let mut message = Ros1::header("lidar").u32(1).u32(8).u32(3);
    for (name, offset) in [("x", 0), ("y", 4), ("z", 8)] {
        message = message.counted(name.as_bytes()).u32(offset).bytes(&[7]).u32(1);
    }
    message.bytes(&[0]).u32(12).u32(96).counted(&data).bytes(&[1]).0
}

pub(super) fn ros1_livox() -> Vec<u8> {
    let mut message = Ros1::header("livox").bytes(&5_u64.to_le_bytes()).u32(4).bytes(&[1, 0, 0, 0]).u32(4);
    for k in 0..4_u32 {
        message = message.u32(k * 1_000_000);
        message = message.bytes(&(k as f32).to_le_bytes()).bytes(&[0; 8]).bytes(&[9, 0, 1]);
    }
    message.0
}

pub(super) fn ros1_odometry() -> Vec<u8> {
    let pose: Vec<u8> =
        [1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0_f64].iter().flat_map(|c| c.to_le_bytes()).collect();
    Ros1::header("odom").counted(b"base_link").bytes(&pose).bytes(&[0; 84 * 8]).0
}

pub(super) fn bin() -> Vec<u8> {
    (0..400).flat_map(|k| (k as f32).to_le_bytes()).collect()
}

/// A time for each point of [`bin`].
pub(super) fn bin_times() -> Vec<u8> {
    (0..100).flat_map(|k| (k as f32 * 0.001).to_le_bytes()).collect()
}

/// A kind of LAS file.
#[derive(Clone, Copy)]
pub(super) struct Las {
    pub(super) name: &'static str,
    pub(super) file: &'static str,
    format: u8,
}

impl Las {
    pub(super) fn extension(&self) -> &'static str {
        &self.file[4..]
    }
}

pub(super) const LAS: [Las; 3] = [
    Las { name: "las", file: "map.las", format: 1 },
    Las { name: "laz", file: "map.laz", format: 1 },
    Las { name: "layered_laz", file: "map.laz", format: 6 },
];

/// As scans: near the sensor.
pub(super) fn las_scan(kind: Las) -> Vec<Vec<u8>> {
    vec![written(kind.file, |path| drop(crate::cloud::write_las_scan(path, 500, kind.format)))]
}

/// As a map.
pub(super) fn las(kind: Las) -> Vec<Vec<u8>> {
    let own = written(kind.file, |path| drop(crate::cloud::write_las_scan(path, 500, kind.format)));
    let theirs = ["extra_bytes", "format1", "format3", "format6", "format7"];
    let theirs = theirs.iter().map(|name| of_others(&format!("clouds/las_{name}.{}", kind.extension())));
    std::iter::once(own).chain(theirs).collect()
}

/// In world coordinates.
pub(super) fn world(kind: Las) -> Vec<Vec<u8>> {
    let point = |k: i64| (k as f64 * 0.01, Point3::new(500_000.0 + k as f64, 4_000_000.0, 1.0));
    let points: Vec<_> = (0..500).map(point).collect();
    let file = WorldFile { format: kind.format, standard_time: false, unit_m: 1.0, points: &points };
    vec![written(kind.file, |path| file.write(path))]
}

pub(super) fn own_laz_scan() -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("own");
    let mut writer = FolderScanWriter::create(&path, FolderFormat::Laz).unwrap();
    writer.write_scan(&scans(1, 300, true)[0]).unwrap();
    writer.finish().unwrap();
    fs::read(path.join("scans/000000.laz")).unwrap()
}
