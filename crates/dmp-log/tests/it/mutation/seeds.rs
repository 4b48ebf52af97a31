//! Good files of the project's own writers, and of the tests' builders.

use std::fs;
use std::path::Path;

use crate::common::{Message, POINTS, scans, write_mcap, write_with};
use crate::damage::others;
use crate::las_log::WorldFile;
use crate::topics::{ODOMETRY, PATH, TF, TF_STATIC, odometry, path as path_of, transforms};
use dmp_log::{FolderFormat, FolderScanWriter, McapCompression};
use dmp_sensor::{Isometry3, Point3};

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
    let options = packed.into_iter().flat_map(|packed| [true, false].map(|chunked| (packed, chunked)));
    options
        .map(|(packed, chunked)| {
            let options = no_checksums().compression(packed).use_chunks(chunked);
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

/// One of gtsam, and one without information that has a loop.
pub(super) fn pose_graphs() -> Vec<Vec<u8>> {
    let vertex = |id| format!("VERTEX_SE3:QUAT {id} {id}.5 -2e1 0 0 0 0.6 0.8\n");
    let edge = |id| format!("EDGE_SE3:QUAT {id} {} 1 0 0.25 0 0 0 1\r\n", (id + 1) % 5);
    let own: String = (0..5).map(|id| vertex(id) + &edge(id)).collect();
    let (_, gtsam) = others("trajectories/gtsam.g2o").unwrap().remove(0);
    vec![gtsam, format!("# a loop\nFIX 0\n{own}").into_bytes()]
}

/// Parts of a message of ROS 1: little-endian, without padding; `counted` behind their length.
fn header(frame: &str) -> Vec<u8> {
    let words: [u32; 4] = [3, 1_690_309_709, 5, frame.len() as u32];
    [words.map(u32::to_le_bytes).concat(), frame.into()].concat()
}

fn counted(bytes: &[u8]) -> Vec<u8> {
    [&(bytes.len() as u32).to_le_bytes(), bytes].concat()
}

/// Logs with a cloud, a message of Livox and an odometry of ROS 1.
pub(super) fn ros1() -> Vec<Vec<u8>> {
    let u32s = |numbers: &[u32]| numbers.iter().flat_map(|number| number.to_le_bytes()).collect::<Vec<_>>();
    let field =
        |name: &str, offset| [counted(name.as_bytes()), u32s(&[offset]), vec![7], u32s(&[1])].concat();
    let data: Vec<u8> = (0..24).flat_map(|k| (k as f32).to_le_bytes()).collect();
    let fields = [field("x", 0), field("y", 4), field("z", 8)].concat();
    let layout = [vec![0], u32s(&[12, 96])].concat();
    let cloud = [header("lidar"), u32s(&[1, 8, 3]), fields, layout, counted(&data), vec![1]].concat();
    let point =
        |k: u32| [&u32s(&[k * 1_000_000])[..], &(k as f32).to_le_bytes(), &[0; 8], &[9, 0, 1]].concat();
    let points: Vec<u8> = (0..4).flat_map(point).collect();
    let livox =
        [header("livox"), 5_u64.to_le_bytes().into(), u32s(&[4]), vec![1, 0, 0, 0], u32s(&[4]), points];
    let pose = [1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0_f64].map(f64::to_le_bytes).concat();
    let odometry = [header("odom"), counted(b"base_link"), pose, vec![0; 84 * 8]].concat();
    let channels = [
        ("/points", "sensor_msgs/PointCloud2", "ros1"),
        ("/odom", "nav_msgs/Odometry", "ros1"),
        ("/livox", "livox_ros_driver/CustomMsg", "ros1"),
    ];
    let log = |channels: &[_], messages: &[_]| {
        let options = no_checksums().compression(None);
        written("log.mcap", |path| write_with(path, options, channels, messages))
    };
    let clouds = [(0, cloud.clone()), (0, cloud), (1, odometry)];
    vec![log(&channels[..2], &clouds), log(&channels[2..], &[(0, livox.concat()), (0, livox.concat())])]
}

pub(super) fn bin() -> Vec<u8> {
    (0..400).flat_map(|k| (k as f32).to_le_bytes()).collect()
}

/// A time for each point of [`bin`].
pub(super) fn bin_times() -> Vec<u8> {
    (0..100).flat_map(|k| (k as f32 * 0.001).to_le_bytes()).collect()
}

/// A scan near the sensor.
pub(super) fn las_scan(file: &str, format: u8) -> Vec<Vec<u8>> {
    vec![written(file, |path| drop(crate::cloud::write_las_scan(path, 500, format)))]
}

/// In world coordinates.
pub(super) fn world(file: &str, format: u8) -> Vec<Vec<u8>> {
    let point = |k: i64| (k as f64 * 0.01, Point3::new(500_000.0 + k as f64, 4_000_000.0, 1.0));
    let points: Vec<_> = (0..500).map(point).collect();
    let world = WorldFile { format, standard_time: false, unit_m: 1.0, points: &points };
    vec![written(file, |path| world.write(path))]
}

pub(super) fn own_laz_scan() -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("own");
    let mut writer = FolderScanWriter::create(&path, FolderFormat::Laz).unwrap();
    writer.write_scan(&scans(1, 300, true)[0]).unwrap();
    writer.finish().unwrap();
    fs::read(path.join("scans/000000.laz")).unwrap()
}
