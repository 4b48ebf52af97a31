//! What parts come to.

use std::fs;
use std::io::{Read as _, Seek as _, SeekFrom, Write as _};
use std::path::Path;
use std::process::{Output, Stdio};
use std::time::Duration;

use serde_json::Value;

use super::{STAGES, TOWN, all_stages, does, files_of, plan, planned, reduced, whole};
use crate::common::{dmp, dmp_command, ends, misused, real_data, refused, text, town_in};

#[test]
fn any_number_of_parts_gives_the_bits_of_one_process() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    town_in(folder);
    for (k, (options, counts)) in [
        ("-t again=truth.tum", [3, 2, 7, 2]),
        ("--drift --every 2 --voxel 0.3 --memory 64MiB", [1, 5, 1, 3]),
        ("--returns 1/3 --segment 2s --drift=4", [2, 1, 3, 1]),
        ("--drift=none", [7, 3, 1, 1]),
    ]
    .into_iter()
    .enumerate()
    {
        let (asked, work) = (format!("{TOWN} {options}"), format!("work-{k}"));
        plan(folder, &work, &asked);
        all_stages(folder, &work, counts);
        assert_eq!(reduced(folder, &work), whole(folder, &asked), "{options} {counts:?}");
    }
    // As tables, and with gates.
    let gate = "--expect drift:R_cv_10<1mm --quiet";
    let output = ends(folder, &format!("shard reduce work-0 {gate}"), 4);
    let whole = dmp(folder, &format!("score {TOWN} -t again=truth.tum {gate}"));
    // A score in parts does not know how thick the maps are.
    let without_table = |output: &Output| -> Vec<String> {
        let lines = text(&output.stdout);
        lines
            .lines()
            .filter(|line| !line.contains("thick") && !line.contains("  ") && !line.contains("more columns"))
            .map(str::to_owned)
            .collect()
    };
    assert!(without_table(&output).len() > 5);
    assert_eq!(without_table(&output), without_table(&whole));
}

#[test]
#[ignore = "nightly: a real drive twice"]
fn a_folder_of_real_scans_gives_them_too() {
    let Some(data) = real_data("nclt_revisit") else { return };
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let data = data.display();
    let asked = format!("{data}/scans -t {data}/poses_lidar_odometry.txt");
    plan(folder, "work", &asked);
    all_stages(folder, "work", [3, 2, 3, 2]);
    assert_eq!(reduced(folder, "work"), whole(folder, &asked));
}

#[test]
fn damage_is_reported_once_and_completely() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    town_in(folder);
    let log = folder.join("town.mcap");
    let mut bytes = fs::read(&log).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 0x55;
    fs::write(&log, bytes).unwrap();
    let expected = whole(folder, TOWN);
    assert!(expected.1 == Some(3) && expected.0["inputs"]["damage"].as_array().unwrap().len() == 1);
    ends(folder, &format!("shard plan {TOWN} -o work"), 3);
    all_stages(folder, "work", [3, 1, 3, 1]);
    assert_eq!(reduced(folder, "work"), expected);
}

#[test]
fn a_part_that_is_done_again_writes_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    planned(folder);
    all_stages(folder, "work", [3, 2, 2, 2]);
    let before = files_of(&folder.join("work"));
    plan(folder, "work", TOWN);
    for (name, parts) in [("fuse", 3), ("merge", 2), ("cast", 2), ("drift", 2)] {
        for part in 1..=parts {
            does(folder, &format!("shard {name} work --part {part}/{parts} --threads 3 --memory 40MiB"));
        }
    }
    let again = files_of(&folder.join("work"));
    let names = |files: &[(String, Vec<u8>)]| files.iter().map(|file| file.0.clone()).collect::<Vec<_>>();
    assert_eq!(names(&again), names(&before));
    for (before, again) in before.iter().zip(&again) {
        assert!(before.1 == again.1, "{}", before.0);
    }
}

#[test]
fn a_killed_part_is_done_again() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    planned(folder);
    let mut kills = [0; 4];
    for (k, name) in STAGES.into_iter().enumerate() {
        for part in 1..=2 {
            let command = format!("shard {name} work --part {part}/2 --threads 1 --quiet");
            for wait_ms in [5, 15, 40] {
                let mut command = dmp_command(folder, &command);
                let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
                std::thread::sleep(Duration::from_millis(wait_ms));
                kills[k] += u32::from(child.try_wait().unwrap().is_none());
                // SIGKILL: nothing of the process runs after this.
                child.kill().unwrap_or_default();
                child.wait().unwrap();
            }
            does(folder, &command);
        }
    }
    assert!(kills.iter().all(|&kills| kills > 0), "{kills:?}");
    assert_eq!(reduced(folder, "work"), whole(folder, TOWN));
}

/// A part reads what it says that it reads, and nothing else.
#[test]
fn a_log_with_holes_does_where_a_part_reads_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    planned(folder);
    all_stages(folder, "work", [3, 2, 3, 2]);
    let expected = files_of(&folder.join("work"));
    let bytes = fs::metadata(folder.join("town.mcap")).unwrap().len();
    let mut named = 0;
    for (name, parts) in [("fuse", 3), ("cast", 3), ("drift", 2), ("merge", 2)] {
        for part in 1..=parts {
            let needs = does(folder, &format!("shard inputs work {name} --part {part}/{parts}"));
            let needs: Value = serde_json::from_slice(&needs.stdout).unwrap();
            for file in needs["log"].as_array().unwrap() {
                assert_eq!((file["name"].as_str(), file["bytes"].as_u64()), (Some(""), Some(bytes)));
                let ranges = ranges_of(&file["ranges"]);
                named +=
                    if name == "cast" { ranges.iter().map(|range| range.end - range.start).sum() } else { 0 };
                copy_ranges(&folder.join("town.mcap"), &folder.join("holes.mcap"), &ranges);
            }
            let only = folder.join("only");
            fs::create_dir_all(&only).unwrap();
            for (file, content) in &expected {
                let is_there = ["json", "part"].map(Some).contains(&extension_of(file));
                let wanted =
                    needs["files"].as_array().unwrap().iter().find(|wanted| wanted["name"] == **file);
                match wanted {
                    Some(wanted) if !wanted["ranges"].is_null() => {
                        copy_ranges(
                            &folder.join("work").join(file),
                            &only.join(file),
                            &ranges_of(&wanted["ranges"]),
                        );
                    }
                    _ if is_there || wanted.is_some() => fs::write(only.join(file), content).unwrap(),
                    _ => {}
                }
            }
            let from = if name == "merge" { "" } else { "--log holes.mcap" };
            let _ = fs::remove_file(only.join(format!("{name}-{part}-of-{parts}.part")));
            does(folder, &format!("shard {name} only --part {part}/{parts} {from} --quiet"));
            for (file, content) in files_of(&only) {
                if file.starts_with(&format!("{name}-{part}-of-{parts}.")) {
                    let before = expected.iter().find(|before| before.0 == file).unwrap();
                    assert!(before.1 == content, "{file}");
                }
            }
            fs::remove_dir_all(&only).unwrap();
        }
    }
    // On a short log every part follows rays of nearly all scans, too.
    let most = 3 * (bytes + (128 << 10));
    assert!(named > bytes / 2 && named <= most, "{named} of {bytes}");
}

fn extension_of(file: &str) -> Option<&str> {
    Path::new(file).extension()?.to_str()
}

fn ranges_of(ranges: &Value) -> Vec<std::ops::Range<u64>> {
    let range = |range: &Value| range["start"].as_u64().unwrap()..range["end"].as_u64().unwrap();
    ranges.as_array().unwrap().iter().map(range).collect()
}

/// A file of the same length that has these bytes and no others.
fn copy_ranges(from: &Path, to: &Path, ranges: &[std::ops::Range<u64>]) {
    let (mut from, mut to) = (fs::File::open(from).unwrap(), fs::File::create(to).unwrap());
    to.set_len(from.metadata().unwrap().len()).unwrap();
    for range in ranges {
        let mut bytes = vec![0; (range.end - range.start) as usize];
        from.seek(SeekFrom::Start(range.start)).unwrap();
        from.read_exact(&mut bytes).unwrap();
        to.seek(SeekFrom::Start(range.start)).unwrap();
        to.write_all(&bytes).unwrap();
    }
}

/// The bytes that a part reads are its share of the log.
#[test]
fn a_part_reads_its_share_of_the_log() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    planned(folder);
    let bytes = fs::metadata(folder.join("town.mcap")).unwrap().len();
    let mut all = 0;
    for part in 1..=4 {
        let stderr = text(&does(folder, &format!("shard fuse work --part {part}/4")).stderr);
        let line = stderr.lines().find(|line| line.starts_with(&format!("fuse {part}/4 is done: "))).unwrap();
        let read: u64 = line.split(' ').nth(4).unwrap().parse().unwrap();
        // What identifies the file is read by every part.
        let share = read - (128 << 10);
        assert!(share * 4 * 10 <= bytes * 13, "{line}");
        all += share;
    }
    assert!(all * 10 <= bytes * 11 && all * 10 >= bytes * 8, "{all} of {bytes}");
}

#[test]
fn what_needs_a_whole_score_is_refused_in_parts() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    town_in(folder);
    for (options, words) in [
        ("--quick", ["--quick in parts", "use `dmp score`"]),
        ("--report a.html", ["--report in parts", "single returns"]),
        ("--scene a.mcap", ["--scene in parts", "single returns"]),
        ("--residuals a.laz", ["--residuals in parts", "single returns"]),
        ("--per-frame a.csv", ["--per-frame in parts", "single returns"]),
        ("--resume", ["--resume in parts", "run again"]),
        ("--keep a.dmp", ["--keep in parts", ""]),
        ("--map truth=truth.tum", ["map of `truth` in parts", "fused from the scans"]),
    ] {
        refused(folder, &format!("shard plan {TOWN} {options} -o work"), 2, &words);
    }
    for part in ["0/3", "4/3", "x", "1/0"] {
        misused(folder, &format!("shard fuse work --part {part}"), &["is no part: try 3/8"]);
    }
}
