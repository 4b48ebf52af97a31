//! Rows 18 and 23: trajectories that do not cover the log, or make no sense. Row 19 is in `conventions.rs` and `sanity.rs`.

use dmp_log::read_trajectory;
use dmp_sensor::Trajectory;
use serde_json::Value;

use super::{assert_close, save_tum, says, scored, town};
use crate::common::{dmp, refused, text, write};

/// The poses of a trajectory whose share of the drive, by time, is kept.
fn part(run: &Trajectory, keep: impl Fn(f64) -> bool) -> Trajectory {
    let stamps_ns = run.stamps_ns().unwrap();
    let (first, last) = (stamps_ns[0], *stamps_ns.last().unwrap());
    let poses = stamps_ns.iter().copied().zip(run.poses().iter().copied());
    let kept = poses.filter(|&(ns, _)| keep((ns - first) as f64 / (last - first) as f64));
    Trajectory::stamped(kept.collect()).unwrap().trajectory
}

#[test]
fn row_18_scans_without_a_pose_are_counted_and_never_extrapolated() {
    let (folder, _) = town();
    let path = folder.path();
    let truth = read_trajectory(&path.join("truth.tum")).unwrap().trajectory;
    save_tum(&path.join("half.tum"), &part(&truth, |share| share <= 0.5));
    save_tum(&path.join("gap.tum"), &part(&truth, |share| !(0.3..0.8).contains(&share)));
    save_tum(&path.join("start.tum"), &part(&truth, |share| share < 0.01));
    for (name, without) in [("half", 11..=13), ("gap", 11..=13)] {
        let report = scored(path, &format!("score town.mcap -t {name}.tum"), 0);
        let count = report["inputs"]["runs"][0]["scans_without_pose"].as_u64().unwrap();
        assert!(without.contains(&count), "{count}");
        assert_eq!(report["inputs"]["scans_used"].as_u64(), Some(24 - count));
        assert!(report["inputs"]["dropped"]["scan_without_pose"].as_u64().unwrap() > 1000);
        let told = format!("{count} of 24 scans have no pose in `{name}`");
        assert!(says(&report["warnings"], &[&told]), "{}", report["warnings"]);
    }
    refused(
        path,
        "score town.mcap -t start.tum",
        1,
        &["`start`: 1 of 24 scans have a pose", "the log spans"],
    );
}

#[test]
fn row_18_lines_that_make_no_sense_are_named() {
    let (folder, _) = town();
    let path = folder.path();
    let good = "1700000000 0 0 0 0 0 0 1\n1700000060 1 0 0 0 0 0 1\n";
    write(path, "empty.tum", "# nothing\n\n");
    write(path, "zero.tum", "1700000000 0 0 0 0 0 0 1\n1700000001 0 0 0 0 0 0 0\n");
    write(path, "nan.tum", "1700000000 0 0 0 0 0 0 1\n\n1700000001 0 nan 0 0 0 0 1\n");
    write(path, "cut.tum", "1700000000 0 0 0 0 0 0 1\n1700000001 0 0 0 0 0");
    write(path, "words.tum", "1700000000 0 0 0 0 zero 0 1\n");
    write(path, "two_runs.tum", &format!("{good}{}", good.replace("000 0 0", "000 5 0")));
    for (file, words) in [
        ("empty.tum", ["no poses", ""]),
        ("zero.tum", ["line 2", "quaternion"]),
        ("nan.tum", ["line 3", "nan"]),
        ("cut.tum", ["line 2", "6"]),
        ("words.tum", ["line 1", "zero"]),
        ("two_runs.tum", ["1700000000", ""]),
    ] {
        refused(path, &format!("score town.mcap -t {file}"), 1, &[file, words[0], words[1]]);
        refused(path, &format!("info town.mcap -t {file}"), 1, &[file, words[0], words[1]]);
    }
    // A cut in the last number leaves a line that could be whole, as that of a file without a last line end.
    let whole = std::fs::read_to_string(path.join("truth.tum")).unwrap();
    write(path, "cut_in_number.tum", &whole[..whole.len() - 3]);
    let report = scored(path, "score town.mcap -t cut_in_number.tum", 0);
    let notes = &report["inputs"]["runs"][0]["notes"];
    assert!(says(notes, &["the last line has no end: it may be cut"]), "{notes}");
}

#[test]
fn row_18_poses_out_of_order_or_again_are_sorted_and_counted() {
    let (folder, _) = town();
    let path = folder.path();
    let wanted = scored(path, "score town.mcap -t run=truth.tum", 0);
    let whole = std::fs::read_to_string(path.join("truth.tum")).unwrap();
    let mut lines: Vec<&str> = whole.lines().collect();
    lines.reverse();
    let again = lines[7];
    lines.push(again);
    write(path, "mixed.tum", &format!("{}\n", lines.join("\n")));
    let output = dmp(path, "score town.mcap -t run=mixed.tum --json");
    let stderr = text(&output.stderr);
    assert!(
        stderr.contains("out of order of time, sorted") && stderr.contains("1 repeated pose left out"),
        "{stderr}"
    );
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(report["runs"], wanted["runs"]);
    let info = scored(path, "info town.mcap -t mixed.tum", 0);
    assert_eq!(info["trajectories"][0]["repeated"], 1);
}

/// What two runs with different parts of the drive get is what both get with the part that they share.
#[test]
fn row_23_runs_are_compared_on_the_scans_that_both_cover() {
    let (folder, _) = town();
    let path = folder.path();
    let [truth, drift] =
        ["truth", "drift"].map(|name| read_trajectory(&path.join(format!("{name}.tum"))).unwrap().trajectory);
    save_tum(&path.join("a.tum"), &part(&truth, |share| share <= 0.8));
    save_tum(&path.join("b.tum"), &part(&drift, |share| share >= 0.2));
    let report = scored(path, "score town.mcap -t a.tum -t b.tum", 0);
    let common = report["inputs"]["scans_used"].as_u64().unwrap();
    assert!((13..=15).contains(&common), "{common}");
    let of_run = |run: usize| report["inputs"]["runs"][run]["scans_without_pose"].as_u64().unwrap();
    assert_eq!(24 - of_run(0) - of_run(1), common);
    for run in ["a", "b"] {
        let words = [format!("have no pose in `{run}`"), format!("compared on the {common} scans")];
        assert!(says(&report["warnings"], &[&words[0], &words[1]]), "{}", report["warnings"]);
    }
    std::fs::create_dir(path.join("both")).unwrap();
    let middle = |share: f64| (0.2..=0.8).contains(&share);
    save_tum(&path.join("both/a.tum"), &part(&truth, middle));
    save_tum(&path.join("both/b.tum"), &part(&drift, middle));
    let both = scored(path, "score town.mcap -t both/a.tum -t both/b.tum", 0);
    assert_eq!(both["inputs"]["scans_used"].as_u64(), Some(common));
    assert_eq!(both["order"], report["order"]);
    // Each run is told from its first pose, which is another here: its bits differ.
    assert_close(&both, &report, 1e-9);
    for (a, b) in both["pairs"].as_array().unwrap().iter().zip(report["pairs"].as_array().unwrap()) {
        assert_eq!((&a["verdict"], &a["decided_at_m"]), (&b["verdict"], &b["decided_at_m"]));
    }
}
