//! `dmp score` and `dmp info` as a shell sees them: exit codes, standard output, JSON.

#![expect(clippy::unwrap_used, reason = "a failed unwrap fails the test")]

mod common;

use common::{code, dmp, folder, json, text};

#[test]
fn options_take_effect_and_are_echoed() {
    let folder = folder("options");
    let options = "--every 2 --voxel 0.5 --segment 3m --min-range 2 --max-range 30m --ego -1,-1,-1,1,1,1 \
                   --extrinsic -0.1,0,0.28,0,0,0,1 --time-offset -0.05 --memory 64MiB \
                   --work . --max-time-gap 500ms --point-time ns";
    let output = dmp(&folder, &format!("score town.mcap -t truth.tum --json -q {options}"));
    assert_eq!(code(&output), 0, "{output:?}");
    let config = &json(&output)["config"];
    assert_eq!(config["voxel_m"], 0.5);
    assert_eq!(config["every"], 2);
    assert_eq!(config["ego"], "box");
    assert_eq!(config["min_range_m"], 2.0);
    assert_eq!(config["max_range_m"], 30.0);
    assert_eq!(config["time_offset_s"], -0.05);
    assert_eq!(config["body_from_sensor"], serde_json::json!([-0.1, 0.0, 0.28, 0.0, 0.0, 0.0, 1.0]));
    assert_eq!(json(&output)["memory"]["budget_bytes"], 64 << 20);

    let built = dmp(&folder, "map build town.mcap -t truth.tum --voxel 0.5 -o truth.dmpmap");
    assert_eq!(code(&built), 0, "{built:?}");
    let again = dmp(&folder, "score town.mcap -t truth.tum --voxel 0.5 --map truth=truth.dmpmap");
    assert_eq!(code(&again), 0, "{again:?}");
    assert!(text(&again.stdout).contains("R_near") && !text(&again.stdout).contains("R_cv "), "{again:?}");
}

#[test]
fn a_damaged_log_is_scored_and_reported() {
    let folder = folder("damage");
    // Two chunks, so that one is left.
    let made = dmp(&folder, "simulate town -o long.mcap --truth long.tum --scans 40");
    assert!(made.status.success(), "{made:?}");
    let whole = std::fs::read(folder.join("long.mcap")).unwrap();
    std::fs::write(folder.join("cut.mcap"), &whole[..whole.len() * 9 / 10]).unwrap();
    let scored = dmp(&folder, "score cut.mcap -t truth.tum");
    assert_eq!(code(&scored), 3, "{scored:?}");
    assert!(text(&scored.stdout).contains("lost from the log: "), "{scored:?}");
    assert!(text(&scored.stderr).contains("DAMAGED in 1 place"), "{scored:?}");
    let info = dmp(&folder, "info cut.mcap --json");
    assert_eq!(code(&info), 3);
    assert_eq!(json(&info)["damage"].as_array().unwrap().len(), 1);
}
