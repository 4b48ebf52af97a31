//! Bags of ROS 1: the same scans as from MCAP, by chunks and by the index, whole, unfinished and damaged.

use crate::common::{
    Message, POINTS, assert_says, in_threads, open, open_error, read_all, refusals, scans, write_mcap,
    write_messages,
};
use crate::mcap_damage::File;
use crate::parts::{assert_parts, bits, scans_of};
use crate::ros1::{ALL, Bag, MAGIC, SCANS, bag_header, chunk, cloud, connection, message, packed, record};
use dmp_log::{LogFormat, LogIndex, LogOptions, McapCompression, open_log};
use dmp_sensor::Scan;
use std::fs;

fn file_of(bag: &Bag, written: &[Scan]) -> File {
    File::with("log.bag", bag.bytes.clone(), written.to_vec())
}

#[test]
fn a_bag_has_the_scans_that_the_same_log_in_mcap_has() {
    let written = scans(101, 40, true);
    let folder = tempfile::tempdir().unwrap();
    let mcap = folder.path().join("log.mcap");
    write_mcap(&mcap, &written, McapCompression::Zstd);
    let summary = |log: &dyn dmp_log::ScanLog| {
        let summary = log.summary();
        let times = (summary.point_times.clone(), summary.middle_ns, summary.sweep_ns);
        (summary.returns, summary.span_ns, summary.period_ns, times, summary.damage.clone())
    };
    for packing in ALL {
        let path = folder.path().join("log.bag");
        fs::write(&path, Bag::new(&written, packing).bytes).unwrap();
        let (log, other) = (open(&path), open(&mcap));
        assert_eq!(log.summary().format, LogFormat::Rosbag1);
        assert_eq!(summary(&*log), summary(&*other));
        assert!(in_threads(|| read_all(&*open(&path))) == read_all(&*other));
        assert_eq!(log.groups()[..2], [0..2, 2..4]);
        let outline = assert_parts(&path, &LogOptions::default());
        assert!(outline.bytes_read().is_some_and(|bytes| bytes > 0));

        let text = serde_json::to_string(&log.index().unwrap()).unwrap();
        let index: LogIndex = serde_json::from_str(&text).unwrap();
        let again = index.open(&path).unwrap();
        assert!(scans_of(&*again).iter().map(bits).eq(scans_of(&*other).iter().map(bits)));
    }
    // A folder with the bag alone.
    fs::remove_file(&mcap).unwrap();
    assert_eq!(open(folder.path()).frames().len(), 101);
}

#[test]
fn a_bag_cut_anywhere_keeps_the_whole_chunks_before_the_cut() {
    let written = scans(16, 300, true);
    for packing in ALL {
        let bag = Bag::new(&written, packing);
        let file = file_of(&bag, &written);
        let (middle, first, third) = (bag.bytes.len() / 2, bag.chunks[0].end, bag.chunks[2].clone());
        for cut in [first, first + 1, first + 30, third.start + 3, third.start + 40, third.end - 1, middle] {
            let kept = bag.chunks.iter().filter(|chunk| chunk.end <= cut).count() * SCANS;
            let damage = file.damage(&bag.bytes[..cut], &written[..kept], true);
            let [damage] = damage.as_slice() else { panic!("{damage:?}") };
            assert_says(damage, &["byte ", &format!("ends at byte {cut}"), "lost"]);
        }
        // Cut in the index, or with one that lies, no scan is lost.
        let mut lying = bag.bytes.clone();
        lying[bag.index_at + 3] = 0xff;
        for broken in [&bag.bytes[..bag.bytes.len() - 3], &bag.bytes[..bag.index_at + 10], &lying] {
            let damage = file.damage(broken, &written, true);
            let place = format!("byte {}: ", bag.index_at);
            assert_says(&damage[0], &[&place, "index", "cut or damaged", "no scan is lost"]);
        }
        // Nor where the first record has another place for it.
        for place in [MAGIC.len(), bag.chunks[1].start, bag.chunks[1].start + 9, usize::MAX] {
            let mut lying = bag.bytes.clone();
            let head = bag_header(place as u64, bag.chunks.len() as u32);
            lying[MAGIC.len()..MAGIC.len() + head.len()].copy_from_slice(&head);
            assert_says(&file.damage(&lying, &written, true)[0], &["without an index"]);
        }
        fs::write(&file.path, &bag.bytes[..first - 1]).unwrap();
        assert_says(
            &open_error(&file.path, &LogOptions::default()),
            &["log.bag", "no scan can be read", "byte"],
        );
    }
}

/// While rosbag records, its last chunk is one without bytes, and messages behind it.
#[test]
fn a_bag_that_was_not_closed_is_read_as_far_as_it_goes() {
    let written = scans(16, 100, true);
    for packing in ALL {
        let bag = Bag::new(&written[..14], packing);
        let file = file_of(&bag, &written);
        let mut bytes = bag.unfinished();
        let damage = file.damage(&bytes, &written[..14], true);
        assert_says(&damage.join("; "), &["ends at byte", "without an index", "what was to follow is lost"]);
        bytes.extend(chunk(packing, 0, &[]));
        for scan in &written[14..] {
            bytes.extend(message(scan.stamp_ns.unwrap(), &cloud(scan)));
        }
        assert_eq!(file.damage(&bytes, &written, true).len(), 1);
        let damage = file.damage(&bytes[..bytes.len() - 1], &written[..15], true);
        assert_says(&damage.join("; "), &["a record of type 0x02", "the tail is lost"]);
    }
}

#[test]
fn what_is_damaged_in_a_bag_is_named_and_costs_no_more_than_its_chunk() {
    let written = scans(16, 300, true);
    for packing in ALL {
        let bag = Bag::new(&written, packing);
        let file = file_of(&bag, &written);
        let chunk = bag.chunks[2].clone();
        let kept = [&written[..4], &written[6..]].concat();
        // The values of its fields, behind their names: operation, compression, size, length of the data.
        let at = |name: &[u8]| {
            let bytes = &bag.bytes[chunk.clone()];
            chunk.start + bytes.windows(name.len()).position(|part| part == name).unwrap() + name.len()
        };
        let size = at(b"size=");
        for (place, byte, says) in [
            (at(b"op="), 0x15, "unknown type 0x15 is skipped"),
            (at(b"op="), 4, "messages that the index counts are not there"),
            (at(b"compression="), b'z', "unknown compression `z"),
            (size, bag.bytes[size] ^ 1, "bytes"),
            (size + 3, 0xff, "more than the 268,435,456 allowed"),
            (size + 7, 0x7f, "past the chunk at byte"),
            (chunk.start + 3, 0xff, "past the chunk at byte"),
        ] {
            let mut broken = bag.bytes.clone();
            broken[place] = byte;
            let damage = file.damage(&broken, &kept, false);
            assert_says(&damage.join("; "), &["byte ", says]);
        }
        if packing == "bz2" {
            // Its blocks have checksums.
            let mut broken = bag.bytes.clone();
            broken[usize::midpoint(chunk.start, chunk.end)] ^= 0x10;
            let damage = file.damage(&broken, &kept, true);
            assert_says(&damage[0], &[&format!("byte {}: ", chunk.start), "damaged and skipped"]);
        }
        // An index of the messages of a chunk that points beside them, or is cut.
        for (behind, by_index) in [(chunk.end, true), (bag.chunks[3].start - 4, false)] {
            let mut broken = bag.bytes.clone();
            broken[behind + if by_index { 8 } else { 0 }] ^= 3;
            fs::write(&file.path, &broken).unwrap();
            let log = open_log(&file.path, &LogOptions::default()).unwrap();
            assert_eq!(log.frames().len(), 16);
            let outline = dmp_log::outline_log(&file.path, &LogOptions::default()).unwrap();
            let part = outline.open(&(0..outline.scans().len()).collect::<Vec<_>>()).unwrap();
            let damage = format!("{:?} {:?}", part.summary().damage, part.summary().notes);
            assert!(part.frames().len() >= 15 && damage.contains("index"), "{damage}");
        }
    }
}

/// A few bytes that claim, and unpack to, far more than is allowed.
#[test]
fn claims_of_a_bag_are_not_believed() {
    let written = scans(8, 50, true);
    let bag = Bag::new(&written, "none");
    let file = file_of(&bag, &written);
    let zeros = vec![0; 8 << 20];
    for (forged, says) in [
        (chunk("bz2", 1 << 28, &packed(&zeros, "bz2")), "it unpacks to 8,388,608 bytes, its header says"),
        (chunk("lz4", 100, &packed(&zeros, "lz4")), "it unpacks to 101 bytes, its header says 100"),
        (chunk("bz2", 100, &[1; 40]), "damaged"),
        (chunk("none", 100, &[1; 4]), "not compressed"),
        (record(&[("op", &[5])], &[1; 4]), "unknown compression"),
        (record(&[("op", &[2]), ("conn", &[0; 4])], &[1; 4]), "no whole header"),
        (record(&[("op", &[7]), ("conn", &[0; 4])], &[1; 4]), "a connection has no `topic`"),
        (connection("/points", "std_msgs/String"), "described twice, differently"),
    ] {
        let at = bag.chunks[3].start;
        let bytes = [&bag.unfinished()[..at], &forged].concat();
        let damage = file.damage(&bytes, &written[..6], false).join("; ");
        assert_says(&damage, &[&format!("byte {at}: "), says]);
    }
}

/// What a long bag has at its end: more than is unpacked of any one record.
#[test]
fn an_index_may_be_larger_than_any_record() {
    let written = scans(24, 50, true);
    let bag = Bag::new(&written, "none");
    let file = file_of(&bag, &written);
    let mut bytes = bag.bytes[..bag.index_at].to_vec();
    bytes.extend(connection("/points", "sensor_msgs/PointCloud2"));
    for chunk in &bag.chunks {
        let at = (chunk.start as u64).to_le_bytes();
        let info: [(&str, &[u8]); 4] =
            [("op", &[6]), ("ver", &[1, 0, 0, 0]), ("chunk_pos", &at), ("count", &[1, 0, 0, 0])];
        let mut counts = [[0; 4], (SCANS as u32).to_le_bytes()].concat();
        // Of connections without a message here.
        counts.resize(24 << 20, 0);
        bytes.extend(record(&info, &counts));
    }
    assert!(bytes.len() - bag.index_at > 256 << 20);
    assert_eq!(file.damage(&bytes, &written, true), [""; 0]);
    let damage = file.damage(&bytes[..bytes.len() - 1], &written, true);
    assert_says(&damage[0], &["the index at the end is cut or damaged"]);
}

#[test]
fn bags_that_cannot_be_read_are_refused_with_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let written = scans(4, 50, true);
    let bag = Bag::new(&written, "none");
    let head = bag_header(0, 0);
    let encrypted = record(&[("op", &[3]), ("encryptor", b"rosbag/AesCbcEncryptor")], &[]);
    let behind = &bag.bytes[MAGIC.len() + head.len()..];
    let packets = |message_type| Bag::of(message_type, &[(0, vec![0; 50])], "lz4").bytes;
    let bags = [
        ("old.bag", [b"#ROSBAG V1.2\n", &bag.bytes[13..]].concat()),
        ("encrypted.bag", [MAGIC, &encrypted, behind].concat()),
        ("velodyne.bag", packets("velodyne_msgs/VelodyneScan")),
        ("ouster.bag", packets("ouster_ros/PacketMsg")),
        ("draco.bag", packets("draco_point_cloud_transport/CompressedPointCloud2")),
        ("images.bag", packets("sensor_msgs/Image")),
    ];
    for (name, bytes) in bags {
        fs::write(folder.path().join(name), bytes).unwrap();
    }
    let cloud = Message::of(&[[1.0; 3]]).encode();
    for (name, message_type) in [
        ("velodyne.mcap", "velodyne_msgs/msg/VelodyneScan"),
        ("ouster.mcap", "ouster_sensor_msgs/msg/PacketMsg"),
        ("draco.mcap", "point_cloud_interfaces/msg/CompressedPointCloud2"),
        ("foxglove.mcap", "foxglove.PointCloud"),
        ("foxglove_msgs.mcap", "foxglove_msgs/msg/PointCloud"),
    ] {
        let packets = ("/packets", message_type, "cdr");
        write_messages(&folder.path().join(name), &[packets], &[(0, cloud.clone())]);
        write_messages(
            &folder.path().join("both.mcap"),
            &[packets, POINTS],
            &[(0, vec![0; 9]), (1, cloud.clone())],
        );
    }
    let error = |name: &str| open_error(&folder.path().join(name), &LogOptions::default());
    let cases = [
        ("old.bag", "older than version 2.0 | rosbag filter"),
        ("encrypted.bag", "encrypted | rosbag decrypt"),
        (
            "velodyne.bag",
            "/points holds packets | `roslaunch velodyne_pointcloud VLP16_points.launch` | record /velodyne_points",
        ),
        (
            "ouster.bag",
            "/points holds packets | `roslaunch ouster_ros replay.launch bag_file:= | record /ouster/points",
        ),
        ("velodyne.mcap", "/packets holds packets | `ros2 launch velodyne_pointcloud"),
        ("ouster.mcap", "/packets holds packets | `ros2 launch ouster_ros"),
        ("draco.bag", "/points holds compressed points | `rosrun point_cloud_transport republish draco"),
        ("draco.mcap", "/packets holds compressed points | `ros2 run point_cloud_transport republish"),
        ("foxglove.mcap", "/packets holds points as Foxglove writes them | sensor_msgs/PointCloud2, or"),
        ("foxglove_msgs.mcap", "/packets holds points as Foxglove writes them"),
        (
            "images.bag",
            "no topic with sensor_msgs/PointCloud2 | /points [sensor_msgs/Image (ros1), 1 messages]",
        ),
    ];
    refusals(error, folder.path().to_str().unwrap(), &cases);
    assert!(!error("images.bag").contains("packets"));
    // With clouds beside them there is nothing to convert.
    assert_eq!(open(&folder.path().join("both.mcap")).frames().len(), 1);
}
