//! What cannot be written.

use std::fs;
use std::process::Command;

use serde_json::Value;

use super::tables::table;
use super::{json_of, ply_rows};
use crate::common::{dmp, open, refused, small_town, text, workspace, write_mcap};

#[test]
fn what_cannot_be_written_is_told_before_the_log_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    fs::write(path.join("log.mcap"), "not a log").unwrap();
    fs::copy(workspace().join("data-samples/truth.tum"), path.join("truth.tum")).unwrap();
    fs::create_dir(path.join("taken.ply")).unwrap();
    for (outputs, words) in [
        ("--residuals out.xyz", &["out.xyz", ".laz, .las, .ply, .pcd, .mcap"][..]),
        ("--residuals no/out.laz", &["no/out.laz", "no folder no"]),
        ("--residuals log.mcap", &["log.mcap", "take the place of the input"]),
        ("--residuals truth=./log.mcap", &["log.mcap", "take the place of the input"]),
        ("--residuals other=out.laz", &["other", "the runs are truth"]),
        ("--residuals taken.ply", &["taken.ply", "a folder has this name"]),
        ("--per-frame a.csv --per-tile a.csv", &["a.csv", "two outputs"]),
        ("--per-frame a.parquet", &["a.parquet", "written as .csv"]),
        ("--per-tile no/a.csv", &["no/a.csv", "no folder no"]),
    ] {
        refused(path, &format!("score log.mcap -t truth.tum {outputs}"), 2, words);
    }
    let every = dmp(path, "score log.mcap -t truth.tum --residuals out.ply --residuals-every 0");
    assert_eq!(every.status.code(), Some(2), "{}", text(&every.stderr));
}

#[test]
fn scans_without_stamps_are_no_mcap() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let output = dmp(path, "convert log @/town.mcap -o town --to bin --quiet");
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    fs::remove_file(path.join("town/times.txt")).unwrap();
    let truth = open(&workspace().join("data-samples/town.mcap"));
    let lines = "1 0 0 0 0 1 0 0 0 0 1 0\n".repeat(truth.frames().len());
    fs::write(path.join("run.txt"), lines).unwrap();
    let score = "score town -t run.txt --point-time ignore --sample 5";
    refused(path, &format!("{score} --residuals out.mcap"), 2, &["out.mcap", "no stamps", ".laz"]);
    json_of(path, &format!("{score} --residuals out.ply --per-frame frames.csv"));
    assert!(ply_rows(&path.join("out.ply")).iter().all(|row| row.time_s == 0.0));
    assert!(table(&path.join("frames.csv")).iter().all(|row| row["stamp_ns"].is_empty()));
}

#[cfg(unix)]
#[test]
fn a_full_disk_leaves_the_scores_and_no_half_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let (scans, truth) = small_town(24, 150);
    write_mcap(&path.join("town.mcap"), &scans);
    let mut lines = Vec::new();
    dmp_log::write_tum(&mut lines, &truth).unwrap();
    fs::write(path.join("truth.tum"), lines).unwrap();
    fs::create_dir(path.join("disk")).unwrap();
    let dmp = env!("CARGO_BIN_EXE_dmp-under-test");
    // Once the files have no room, once what waits to be written: so little less than it takes that it is tried.
    let script = format!(
        "mount -t tmpfs -o size=200k none disk || exit 99; \
         {dmp} score town.mcap -t truth.tum --residuals disk/out.ply --work . --json --quiet >out.json 2>out.txt; \
         echo $? >out.code; ls -A disk >left.txt; \
         mount -o remount,size=2100k disk || exit 99; \
         {dmp} score town.mcap -t truth.tum --residuals out.ply --work disk --quiet 2>work.txt; echo $? >work.code"
    );
    let output = Command::new("unshare")
        .args(["--map-root-user", "--mount", "sh", "-c", &script])
        .current_dir(path)
        .output();
    match output {
        Ok(output) if output.status.code() != Some(99) && path.join("work.code").exists() => {}
        _ => {
            println!("skipped: this system does not let us mount a disk of our own");
            return;
        }
    }
    let read = |name: &str| fs::read_to_string(path.join(name)).unwrap();
    assert_eq!((read("out.code").trim(), read("left.txt").as_str()), ("1", ""), "{}", read("out.txt"));
    assert!(read("out.txt").contains("disk/out.ply: cannot write"), "{}", read("out.txt"));
    let report: Value = serde_json::from_str(&read("out.json")).unwrap();
    assert_eq!(report["runs"][0]["name"], "truth");
    assert_eq!(read("work.code").trim(), "1");
    assert!(read("work.txt").contains("No space left on device"), "{}", read("work.txt"));
    assert!(!path.join("out.ply").exists());
}
