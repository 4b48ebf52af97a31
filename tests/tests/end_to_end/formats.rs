//! One log in every format: the same scores, to the precision that each format stores.

use std::fs;
use std::path::{Path, PathBuf};

use dmp_sensor::{Isometry3, Point3, Scan, Track};
use serde_json::Value;

use crate::common::{done, ends, has, json, open, refused, sample, text, trajectory, workspace, write};
use crate::ros1;

/// The table that rosbag2 writes, as far as a reader needs it.
const SCHEMA: &str = "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, \
    serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL); \
    CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, \
    data BLOB NOT NULL); CREATE INDEX timestamp_idx ON messages (timestamp ASC);";

/// A rosbag2 folder with the messages of an MCAP file.
fn write_rosbag2(folder: &Path, from: &Path) {
    fs::create_dir(folder).unwrap();
    let metadata = "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: sqlite3\n  \
                    relative_file_paths:\n    - town_0.db3\n  compression_format: \"\"\n  compression_mode: \"\"\n";
    fs::write(folder.join("metadata.yaml"), metadata).unwrap();
    let bag = rusqlite::Connection::open(folder.join("town_0.db3")).unwrap();
    bag.execute_batch(SCHEMA).unwrap();
    let bytes = fs::read(from).unwrap();
    for (number, message) in mcap::MessageStream::new(&bytes).unwrap().enumerate() {
        let message = message.unwrap();
        if number == 0 {
            let channel = &message.channel;
            let kind = &channel.schema.as_ref().unwrap().name;
            let row = (&channel.topic, kind, &channel.message_encoding);
            bag.execute("INSERT INTO topics VALUES (1, ?1, ?2, ?3, '')", row).unwrap();
        }
        let row = (message.log_time.cast_signed(), message.data.as_ref());
        bag.execute("INSERT INTO messages(topic_id, timestamp, data) VALUES (1, ?1, ?2)", row).unwrap();
    }
}

const RUNS: &str = "-t @/truth.tum -t @/drift.tum --voxel 0.3 --trust --drift=none";

/// The scores of the samples on a log, without what depends on the file.
fn scores(folder: &Path, log: &str) -> Value {
    let mut report = json(folder, &format!("score {log} {RUNS}"));
    assert_eq!(report["inputs"]["scans_used"], 100, "{log}");
    let kept = ["runs", "order", "ties", "pairs"].map(|part| (part.to_owned(), report[part].take()));
    Value::Object(kept.into_iter().collect())
}

/// The largest relative difference of two numbers that stand in the same place; whatever else there is must
/// be equal, but for sentences with numbers.
fn largest_difference(a: &Value, b: &Value, place: &str) -> f64 {
    match (a, b) {
        (Value::Number(a), Value::Number(b)) => {
            let [a, b] = [a, b].map(|number| number.as_f64().unwrap());
            if a == b { 0.0 } else { (a - b).abs() / a.abs().max(b.abs()) }
        }
        (Value::Array(a), Value::Array(b)) => {
            assert_eq!(a.len(), b.len(), "{place}");
            // An end of an interval may be anywhere near 0: it is off in parts of the end that is further from there.
            if let ([Value::Number(_), ..], [Value::Number(_), ..]) = (&a[..], &b[..]) {
                let [a, b] = [a, b].map(|ends| ends.iter().map(|end| end.as_f64().unwrap()));
                let largest = a.clone().chain(b.clone()).fold(0.0, |most: f64, end| most.max(end.abs()));
                let off = a.zip(b).fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()));
                return if off == 0.0 { 0.0 } else { off / largest };
            }
            a.iter().zip(b).map(|(a, b)| largest_difference(a, b, place)).fold(0.0, f64::max)
        }
        (Value::Object(a), Value::Object(b)) => {
            let each = a.iter().filter(|(key, _)| *key != "reason" && *key != "warnings");
            each.map(|(key, a)| largest_difference(a, &b[key], &format!("{place}/{key}"))).fold(0.0, f64::max)
        }
        _ => {
            assert_eq!(a, b, "{place}");
            0.0
        }
    }
}

/// Seconds from GPS's own count (less 1e9) to that of Unix, with the leap seconds since 2017.
const UNIX_FROM_GPS_S: f64 = 1e9 + 315_964_800.0 - 18.0;

/// Writes the sample town as a mobile mapper would: one file in the world's coordinates, each point with its GPS
/// time, coordinates to 0.1 mm.
fn write_world_laz(path: &Path) {
    let (log, truth) = (open(&sample("town.mcap")), trajectory(&sample("truth.tum")));
    let track = Track::new(&truth, Isometry3::identity(), 1_000_000_000);
    let mut builder = las::Builder::from((1, 4));
    builder.point_format = las::point::Format::new(6).unwrap();
    builder.point_format.is_compressed = true;
    builder.gps_time_type = las::GpsTimeType::Standard;
    let axis = las::Transform { scale: 1e-4, offset: 0.0 };
    builder.transforms = las::Vector { x: axis, y: axis, z: axis };
    let mut writer = las::Writer::from_path(path, builder.into_header().unwrap()).unwrap();
    let (mut reader, mut scan) = (log.reader().unwrap(), Scan::default());
    for frame in 0..log.frames().len() {
        reader.read(frame, &mut scan).unwrap();
        for (point, offset_ns) in scan.points_in_sensor_m.iter().zip(&scan.time_offsets_ns) {
            let stamp_ns = scan.stamp_ns.unwrap() + offset_ns;
            let world_from_sensor = track.world_from_sensor_at(stamp_ns).unwrap();
            let place = world_from_sensor * Point3::from(point.map(f64::from));
            let gps_time = Some((stamp_ns as f64 / 1e9) - UNIX_FROM_GPS_S);
            let [x, y, z] = [place.x, place.y, place.z];
            writer.write_point(las::Point { x, y, z, gps_time, ..las::Point::default() }).unwrap();
        }
    }
    writer.close().unwrap();
}

/// The file has the time of each point, on a clock of its own; the error gives the offset of the clocks, and with it the scores
/// are those of the log.
#[test]
fn the_same_town_in_world_coordinates_gives_the_same_scores() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    write_world_laz(&at.join("world.laz"));
    let convert = "convert log world.laz --made-with @/truth.tum --scan-period 0.5 -o log.mcap";
    let offset = "--time-offset 1315964782";
    has(&text(&ends(at, convert, 2).stderr), &[offset]);
    done(at, &format!("{convert} {offset}"));
    let found = json(at, &format!("score log.mcap {RUNS} {offset}"));
    let expected = json(at, &format!("score @/town.mcap {RUNS}"));
    assert_eq!(found["order"], expected["order"]);
    // A return on the edge of the ranges that are used may fall on either side.
    let [a, b] = [&found, &expected].map(|report| report["inputs"]["returns_used"].as_f64().unwrap());
    assert!((a - b).abs() <= 1e-3 * b, "{a} and {b} returns");
    for run in 0..2 {
        for score in [["r_cv_m2", "2"], ["r_near_m2", "0.5"]] {
            let [a, b] =
                [&found, &expected].map(|report| report["runs"][run][score[0]][score[1]].as_f64().unwrap());
            assert!((a - b).abs() <= 5e-3 * b, "{run} {score:?}: {a} and {b}");
        }
    }
}

/// PCD and messages keep every bit of a scan. `.bin` keeps times to 4 ns, LAS and LAZ keep coordinates to
/// 0.1 mm: the sums move a little, the order and the verdicts do not.
#[test]
fn the_same_town_in_every_format_gives_the_same_scores() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    write_rosbag2(&at.join("bag"), &sample("town.mcap"));
    let conversions = [
        ("lz4.mcap", "--compression lz4"),
        ("bin", "--to bin"),
        ("pcd", "--to pcd"),
        ("las", "--to las"),
        ("laz", "--to laz"),
    ];
    for (output, options) in conversions {
        done(at, &format!("convert log @/town.mcap -o {output} {options}"));
    }
    let log = open(&sample("town.mcap"));
    let mut reader = log.reader().unwrap();
    let mut read = |frame| {
        let mut scan = Scan::default();
        reader.read(frame, &mut scan).unwrap();
        scan
    };
    let town: Vec<Scan> = (0..log.frames().len()).map(&mut read).collect();
    for packing in ros1::ALL {
        fs::write(at.join(format!("{packing}.bag")), ros1::Bag::new(&town, packing).bytes).unwrap();
    }
    let expected = scores(at, "@/town.mcap");
    for exact in ["bag", "lz4.mcap", "pcd", "none.bag", "lz4.bag", "bz2.bag"] {
        assert_eq!(scores(at, exact), expected, "{exact}");
    }
    let laz = scores(at, "laz");
    assert_eq!(scores(at, "las"), laz);
    for (name, found, most) in [(".bin", scores(at, "bin"), 1e-4), (".laz", laz, 5e-3)] {
        for part in ["order", "ties"] {
            assert_eq!(found[part], expected[part], "{name}");
        }
        for part in ["runs", "pairs"] {
            let off = largest_difference(&found[part], &expected[part], part);
            assert!(off < most, "{name}: {part} differ by {off}");
        }
    }
}

/// The log and the poses of bags that other software wrote, against the same messages in MCAP: topics of the log and of another
/// bag, a chain of frames, the extrinsic.
#[test]
fn bags_of_other_software_give_the_scores_of_the_same_log_in_mcap() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::copy(conformance("mcap/poses.mcap"), at.join("log.mcap")).unwrap();
    let score = |log: &str, poses: &str| {
        let mut report =
            json(at, &format!("score {log} -t run={poses}:/odom -t tf={poses}:/tf:odom:lidar --trust"));
        assert!(report["inputs"]["scans_used"].as_u64() >= Some(4), "{report}");
        ["runs", "order", "pairs"].map(|part| report[part].take())
    };
    let expected = score("log.mcap", "log.mcap");
    for packing in ros1::ALL {
        let bag = format!("{packing}.bag");
        fs::copy(conformance(&format!("rosbag1/poses_{bag}")), at.join(&bag)).unwrap();
        for (log, poses) in [(bag.as_str(), bag.as_str()), ("log.mcap", &bag), (&bag, "log.mcap")] {
            assert_eq!(score(log, poses), expected, "{log} {poses}");
        }
    }
}

fn conformance(name: &str) -> PathBuf {
    workspace().join("tests/conformance").join(name)
}

#[test]
fn a_conversion_overwrites_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    write(path, "out.mcap", "precious");
    for wrong in ["-o out.mcap", "-o new --to pcd --compression lz4", "-o new.mcap --to bin"] {
        ends(path, &format!("convert log @/town.mcap {wrong}"), 2);
    }
    assert_eq!(fs::read(path.join("out.mcap")).unwrap(), b"precious");
    assert!(!path.join("new.mcap").exists() && !path.join("new").exists());
}

/// A return that did not come back often has a zero for its absolute time; it must not move the stamps. The folder of the scans,
/// named from within, has the same companions.
#[test]
fn converted_scans_keep_their_stamps() {
    let folder = tempfile::tempdir().unwrap();
    let log = conformance("mcap/robosense.mcap");
    done(folder.path(), &format!("convert log {} -o log --to bin", log.display()));
    let times = fs::read_to_string(folder.path().join("log/times.txt")).unwrap();
    assert!(times.lines().all(|line| line.starts_with("1700000000.")), "{times}");
    let info = json(&folder.path().join("log/scans"), "info .");
    let scans = &info["streams"][0]["scans"];
    assert!(scans["span_ns"].is_array() && scans["point_times"].is_string(), "{info}");
}

/// A bag is a bag whatever maps lie beside it, points of 20 bytes are not read as points of 16, a world's tiles are no scans, and
/// the error for an old ROS 1 bag says how it becomes readable.
#[test]
fn files_that_look_like_something_else_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    for name in ["bag", "tiles", "bins"] {
        fs::create_dir(path.join(name)).unwrap();
    }
    for file in fs::read_dir(conformance("rosbag2/sqlite3")).unwrap() {
        let file = file.unwrap();
        fs::copy(file.path(), path.join("bag").join(file.file_name())).unwrap();
    }
    fs::copy(conformance("clouds/open3d_binary.pcd"), path.join("bag/map.pcd")).unwrap();
    has(&done(path, "info bag"), &["rosbag2 (SQLite)"]);
    for name in ["a.laz", "b.laz"] {
        fs::copy(conformance("clouds/las_format1.laz"), path.join("tiles").join(name)).unwrap();
    }
    for (number, points) in [5_usize, 6, 7, 9].into_iter().enumerate() {
        fs::write(path.join(format!("bins/{number:06}.bin")), vec![0; 20 * points]).unwrap();
    }
    write(path, "a.bag", "#ROSBAG V1.2\n");
    for (arguments, words) in [
        ("info bag/metadata.yaml", ["name the folder", ""]),
        ("info tiles", ["world coordinates", "--made-with"]),
        ("info bins", ["4 of 4 files", "16 bytes"]),
        ("info a.bag", ["version 2.0", "rosbag filter"]),
        ("score @/town.mcap -t a.bag", ["version 2.0", "rosbag filter"]),
    ] {
        refused(path, arguments, 1, &words);
    }
}
