//! Parts that are missing, damaged, doubled or of another plan: named, never added up.

use std::fs;
use std::path::{Path, PathBuf};

use super::{TOWN, all_stages, does, plan, planned, reduced, stage, whole};
use crate::common::{refused, text};

/// Who reads a file: what is then to be done, and has to refuse it.
fn reader_of(name: &str) -> Vec<&'static str> {
    let (fuse, merge) = ("shard merge work --part 1/2", "shard cast work --part 1/2");
    match (name, Path::new(name).extension().and_then(|extension| extension.to_str())) {
        (_, Some("sums")) => vec![fuse],
        (_, Some("dmpmap")) => vec![merge],
        ("plan.json" | "runs.part", _) => vec![
            "shard fuse work --part 1/3",
            fuse,
            merge,
            "shard drift work --part 1/2",
            "shard reduce work",
        ],
        _ if name.starts_with("fuse") => vec![fuse, "shard reduce work"],
        _ if name.starts_with("merge") => vec![merge, "shard reduce work"],
        _ => vec!["shard reduce work"],
    }
}

#[test]
fn parts_that_are_not_what_they_should_be_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    planned(folder);
    plan(folder, "other", "town.mcap -t truth.tum -t drift=truth.tum --voxel 0.4");
    ["work", "other"].iter().for_each(|work| all_stages(folder, work, [3, 2, 2, 2]));
    let expected = reduced(folder, "work");
    let file = |name: &str| -> PathBuf { folder.join("work").join(name) };
    let mut faults = 0;
    for name in [
        "plan.json",
        "runs.part",
        "fuse-2-of-3.part",
        "fuse-2-of-3.truth.sums",
        "merge-1-of-2.part",
        // The last piece of the last run: there is one however the tiles are shared out.
        "merge-2-of-2.drift.dmpmap",
        "cast-2-of-2.part",
        "drift-1-of-2.part",
    ] {
        let whole = fs::read(file(name)).unwrap();
        let twin = name.replace("2-of-3", "1-of-3").replace("2-of-2", "1-of-2");
        let flipped = |at: usize| {
            let mut bytes = whole.clone();
            bytes[at] ^= 0x20;
            Some(bytes)
        };
        let mut wrong = vec![
            ("cut", Some(whole[..whole.len() - 3].to_vec())),
            ("missing", None),
            ("flipped", flipped(whole.len() / 2)),
            ("of another plan", Some(fs::read(folder.join("other").join(name)).unwrap())),
        ];
        if twin != name && file(&twin).exists() {
            wrong.push(("of another part", Some(fs::read(file(&twin)).unwrap())));
        }
        for (fault, bytes) in wrong {
            match bytes {
                Some(bytes) => fs::write(file(name), bytes).unwrap(),
                None => fs::remove_file(file(name)).unwrap(),
            }
            // Another plan by itself is one, and nothing here belongs to it.
            let is_named = |line: &str| {
                line.contains(name)
                    || (fault == "missing" && line.contains("is missing"))
                    || (name == "plan.json" && line.contains("plan "))
                    || (name == "plan.json" && line.contains("runs "))
            };
            for command in reader_of(name) {
                let output = crate::common::dmp(folder, &format!("{command} --quiet"));
                let line = text(&output.stderr);
                assert_eq!(output.status.code(), Some(1), "{name} {fault}, {command}: {line}");
                assert!(line.lines().count() == 1 && is_named(&line), "{name} {fault}, {command}: {line}");
                assert!(output.stdout.is_empty(), "{name} {fault}, {command}");
                faults += 1;
            }
            fs::write(file(name), &whole).unwrap();
        }
    }
    assert!(faults > 40, "{faults}");
    assert_eq!(reduced(folder, "work"), expected);
}

#[test]
fn a_log_that_is_another_now_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    planned(folder);
    let log = folder.join("town.mcap");
    let whole = fs::read(&log).unwrap();
    let fuse = "shard fuse work --part 1/2";
    fs::write(&log, &whole[..whole.len() - 1]).unwrap();
    refused(folder, fuse, 1, &["town.mcap", "bytes, and had"]);
    let mut ends = whole.clone();
    ends[40] ^= 1;
    fs::write(&log, ends).unwrap();
    refused(folder, fuse, 1, &["town.mcap", "the log that was indexed is crc32:"]);
    let mut chunk = whole.clone();
    chunk[whole.len() / 4] ^= 1;
    fs::write(&log, chunk).unwrap();
    refused(folder, fuse, 1, &["town.mcap", "the chunk at byte", " is damaged: "]);
    fs::remove_file(&log).unwrap();
    refused(folder, fuse, 2, &["town.mcap", "no such file"]);
    // It may lie elsewhere.
    fs::write(folder.join("moved.mcap"), whole).unwrap();
    does(folder, &format!("{fuse} --log moved.mcap"));
    assert!(!folder.join("work/fuse-2-of-2.part").exists() && folder.join("work/fuse-1-of-2.part").exists());
}

#[test]
fn a_plan_belongs_to_its_folder() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    planned(folder);
    refused(folder, &format!("shard plan {TOWN} --every 2 -o work"), 2, &["it holds another plan"]);
    let path = folder.join("work/plan.json");
    let text = fs::read_to_string(&path).unwrap();
    // How many parts make sense is nobody's business but the scheduler's.
    assert!(text.contains("\"cast\": 1,"));
    fs::write(&path, text.replace("\"cast\": 1,", "\"cast\": 9,")).unwrap();
    does(folder, "shard fuse work --part 1/1");
    fs::write(&path, text.replace("\"every\": 1,", "\"every\": 2,")).unwrap();
    refused(
        folder,
        "shard fuse work --part 1/1",
        1,
        &["plan.json", "the plan has changed since it was made"],
    );
    fs::write(&path, text.replace("\"dmp_version\": \"", "\"dmp_version\": \"9.")).unwrap();
    refused(folder, "shard fuse work --part 1/1", 1, &["plan.json", "of dmp 9.", "make it anew"]);
}

/// Two of a scheduler's workers do the same part at the same time.
#[test]
fn twins_do_not_disturb_each_other() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    planned(folder);
    for name in super::STAGES {
        std::thread::scope(|scope| {
            (0..2).for_each(|_| drop(scope.spawn(|| stage(folder, "work", name, 2))));
        });
    }
    assert_eq!(reduced(folder, "work"), whole(folder, TOWN));
}
