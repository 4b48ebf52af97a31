//! One log in every format: the same scores, to the precision that each format stores.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::common::{dmp, text, workspace};

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

/// The scores of the samples on a log, without what tells of the file.
fn scores(folder: &Path, log: &str) -> Value {
    let arguments =
        format!("score {log} -t @/truth.tum -t @/drift.tum -t @/collapsed.tum --json --voxel 0.3");
    let output = dmp(folder, &arguments);
    assert_eq!(output.status.code(), Some(0), "{log}: {}", text(&output.stderr));
    let mut report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(report["inputs"]["scans_used"], 100, "{log}");
    let mut kept = serde_json::Map::new();
    for part in ["runs", "order", "ties", "pairs"] {
        kept.insert(part.into(), report[part].take());
    }
    kept.into()
}

/// The largest relative difference of two numbers that stand in the same place; whatever else there is must
/// be equal, but for the words that tell numbers.
fn largest_difference(a: &Value, b: &Value, place: &str) -> f64 {
    match (a, b) {
        (Value::Number(a), Value::Number(b)) => {
            let [a, b] = [a, b].map(|number| number.as_f64().unwrap());
            if a == b { 0.0 } else { (a - b).abs() / a.abs().max(b.abs()) }
        }
        (Value::Array(a), Value::Array(b)) => {
            assert_eq!(a.len(), b.len(), "{place}");
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

/// PCD, PLY and messages keep every bit of a scan. `.bin` keeps times to 4 ns, LAS and LAZ keep coordinates to
/// 0.1 mm: the sums move a little, the order and the verdicts do not.
#[test]
fn the_same_town_in_every_format_gives_the_same_scores() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let town = workspace().join("data-samples/town.mcap");
    write_rosbag2(&at.join("bag"), &town);
    let conversions = [
        ("lz4.mcap", "--compression lz4"),
        ("none.mcap", "--compression none"),
        ("bin", "--to bin"),
        ("pcd", "--to pcd"),
        ("ply", "--to ply"),
        ("las", "--to las"),
        ("laz", "--to laz"),
    ];
    for (output, options) in conversions {
        let done = dmp(at, &format!("convert log @/town.mcap -o {output} {options}"));
        assert_eq!(done.status.code(), Some(0), "{output}: {}", text(&done.stderr));
    }
    let expected = scores(at, "@/town.mcap");
    for exact in ["bag", "lz4.mcap", "none.mcap", "pcd", "ply"] {
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
            println!("{name}: {part} differ by at most {off:.2e} of their value");
            assert!(off < most, "{name}: {part} differ by {off}");
        }
    }
}
