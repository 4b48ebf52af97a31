//! A few hundred damaged files of each format: whatever comes of them, it is an answer and no panic.

use crate::common::{Message, POINTS, Random, scans, write_mcap, write_with};
use crate::npy::{IDENTITY, npy};
use crate::topics::{ODOMETRY, PATH, TF, TF_STATIC, odometry, path as path_of, transforms};
use dmp_log::{
    LogOptions, McapCompression, PoseTopic, open_log, read_calib, read_topic_trajectory, read_trajectory,
};
use dmp_sensor::{Isometry3, Scan};
use std::fs;
use std::path::Path;

const RUNS: usize = 300;

/// Flips, overwrites, removes or repeats some bytes, or cuts the file.
pub(crate) fn mutate(bytes: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    for _ in 0..=random.next() % 3 {
        // Headers are short and matter most.
        let reach = if random.next().is_multiple_of(2) { bytes.len().min(400) } else { bytes.len() };
        let at = random.next() as usize % reach.max(1);
        let end = (at + 1 + random.next() as usize % 8).min(bytes.len());
        match random.next() % 6 {
            0 => bytes[at] ^= 1 << (random.next() % 8),
            1 => bytes[at] = random.next() as u8,
            2 => bytes[at..end].fill(0xff),
            3 => bytes[at..end].fill(0),
            4 => drop(bytes.drain(at..end)),
            _ => bytes.truncate(at.max(20)),
        }
        if bytes.len() < 20 {
            break;
        }
    }
    bytes
}

fn for_each_mutation(path: &Path, seed: u64, mut check: impl FnMut(&Path)) {
    let bytes = fs::read(path).unwrap();
    let mut random = Random(seed);
    for _ in 0..RUNS {
        fs::write(path, mutate(&bytes, &mut random)).unwrap();
        check(path);
    }
}

fn read_what_opens(path: &Path) {
    let Ok(log) = open_log(path, &LogOptions::default()) else { return };
    let mut reader = log.reader().unwrap();
    let mut scan = Scan::default();
    for frame in 0..log.frames().len() {
        // What was found whole on opening is whole.
        reader.read(frame, &mut scan).unwrap();
        assert_eq!(scan.len() as u64, log.frames()[frame].returns);
        assert!(scan.time_offsets_ns.is_empty() || scan.time_offsets_ns.len() == scan.len());
    }
}

#[test]
fn mcap() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    for (seed, compression) in
        [McapCompression::Zstd, McapCompression::Lz4, McapCompression::None].into_iter().enumerate()
    {
        let written = scans(6, 100, true);
        write_mcap(&path, &written, compression);
        for_each_mutation(&path, seed as u64, |path| {
            read_what_opens(path);
            // Chunks with a checksum give the right points or none.
            if let Ok(log) = open_log(path, &LogOptions::default()) {
                let mut scan = Scan::default();
                let mut reader = log.reader().unwrap();
                for frame in 0..log.frames().len() {
                    reader.read(frame, &mut scan).unwrap();
                    assert!(written.iter().any(|w| w.points_in_sensor_m == scan.points_in_sensor_m));
                }
            }
        });
    }
}

/// Without any checksum, so that the damage reaches the parsers behind.
#[test]
fn mcap_without_checksums() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let message = Message::of(&[[1.0, 2.0, 3.0]; 8]).encode();
    let messages: Vec<_> = (0..4).map(|_| (0, message.clone())).collect();
    for (seed, compression) in
        [None, Some(mcap::Compression::Zstd), Some(mcap::Compression::Lz4)].into_iter().enumerate()
    {
        for chunked in [true, false] {
            let options = mcap::WriteOptions::new()
                .compression(compression)
                .use_chunks(chunked)
                .calculate_chunk_crcs(false)
                .calculate_data_section_crc(false)
                .calculate_summary_section_crc(false);
            write_with(&path, options, &[POINTS], &messages);
            for_each_mutation(&path, 10 + seed as u64, read_what_opens);
        }
    }
}

#[test]
fn trajectories() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.tum");
    for (seed, line) in ["1.5 1 2 3 0 0 0 1\n", "1 0 0 5 0 1 0 6 0 0 1 7\n"].iter().enumerate() {
        fs::write(&path, line.repeat(5)).unwrap();
        for_each_mutation(&path, 20 + seed as u64, |path| drop(read_trajectory(path)));
    }
    let array = "{'descr': '<f8', 'fortran_order': False, 'shape': (5, 4, 4), }";
    fs::write(&path, npy(array, &IDENTITY.repeat(5))).unwrap();
    for_each_mutation(&path, 22, |path| drop(read_trajectory(path)));
    fs::write(&path, "VERTEX_SE3:QUAT 7 1 2 3 0 0 0 1\nVERTEX_SE2 9 1 2 3\nEDGE_SE2 7 9 1\n").unwrap();
    for_each_mutation(&path, 23, |path| drop(read_trajectory(path)));
    fs::write(&path, "P0: 1 2\nTr: 0 -1 0 0 0 0 -1 -0.1 1 0 0 -0.3\n").unwrap();
    for_each_mutation(&path, 24, |path| drop(read_calib(path)));
}

/// Without checksums, so that the damage reaches the messages.
#[test]
fn topics_with_poses() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
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
    let options = mcap::WriteOptions::new().compression(None).calculate_chunk_crcs(false);
    write_with(&path, options, &[POINTS, ODOMETRY, PATH, TF, TF_STATIC], &messages);
    for_each_mutation(&path, 50, |path| {
        read_what_opens(path);
        for topic in ["/odom", "/path", "/tf"] {
            let topic = PoseTopic { topic: Some(topic.into()), ..PoseTopic::default() };
            let Ok(run) = read_topic_trajectory(path, &topic, Some("lidar")) else { continue };
            assert!(run.trajectory.poses().iter().all(|pose| pose.translation.vector.amax() <= 1e9));
        }
    });
}

#[test]
fn clouds() {
    let folder = tempfile::tempdir().unwrap();
    for (seed, (name, format)) in [("a.las", 1), ("b.laz", 3), ("c.laz", 7)].into_iter().enumerate() {
        let path = folder.path().join(name);
        crate::cloud::write_las(&path, 2000, format);
        for_each_mutation(&path, 30 + seed as u64, |path| drop(crate::cloud::read(path)));
    }
    let path = folder.path().join("map.ply");
    let header = "element vertex 5\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
    for (seed, format) in ["ascii", "binary_little_endian", "binary_big_endian"].into_iter().enumerate() {
        let mut bytes = format!("ply\nformat {format} 1.0\n{header}").into_bytes();
        bytes.extend(if format == "ascii" { b"1 2 3\n".repeat(5) } else { vec![0x40; 60] });
        fs::write(&path, bytes).unwrap();
        for_each_mutation(&path, 40 + seed as u64, |path| drop(crate::cloud::read(path)));
    }
    let path = folder.path().join("map.pcd");
    for (seed, data) in ["ascii", "binary", "binary_compressed"].into_iter().enumerate() {
        fs::write(&path, crate::pcd::file(data, 20)).unwrap();
        for_each_mutation(&path, 50 + seed as u64, |path| drop(crate::cloud::read(path)));
    }
}
