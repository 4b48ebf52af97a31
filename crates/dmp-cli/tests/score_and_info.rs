//! `dmp score` and `dmp info` as a shell sees them: exit codes, standard output, JSON.

#![expect(clippy::unwrap_used, reason = "a failed unwrap fails the test")]

mod common;

use common::{code, dmp, folder, json, text};
use serde_json::Value;

fn keys(value: &Value) -> Vec<&str> {
    value.as_object().unwrap().keys().map(String::as_str).collect()
}

#[test]
fn scores_are_one_json_object_or_a_table() {
    let folder = folder("scores");
    let table = dmp(&folder, "score town.mcap -t truth.tum noise.tum");
    assert_eq!(code(&table), 0, "{table:?}");
    assert!(
        text(&table.stdout).contains("1  truth") && text(&table.stdout).contains("2  noise"),
        "{table:?}"
    );
    assert!(text(&table.stderr).contains("40 scans over"), "{table:?}");
    assert!(!text(&table.stderr).contains('\r'), "a progress bar where there is no terminal: {table:?}");

    let machine = dmp(&folder, "score town.mcap -t truth.tum -t b=noise.tum --json --quiet --threads 1");
    assert_eq!((code(&machine), text(&machine.stderr)), (0, ""));
    let scores = json(&machine);
    let expected = [
        "schema",
        "dmp_version",
        "drift",
        "config",
        "inputs",
        "free_space",
        "gates",
        "runs",
        "left_out",
        "order",
        "ties",
        "pairs",
        "sampling",
        "warnings",
        "timing",
        "memory",
        "promise",
    ];
    let mut found = keys(&scores);
    let mut expected = expected.to_vec();
    found.sort_unstable();
    expected.sort_unstable();
    assert_eq!(found, expected);
    assert_eq!(scores["schema"], "dmp-score/2");
    assert_eq!(scores["order"], serde_json::json!(["truth", "b"]));
    assert_eq!(scores["pairs"][0]["verdict"], "truth");
    assert_eq!(scores["timing"]["threads"], 1);
}

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
fn wrong_usage_is_reported_in_one_line() {
    let folder = folder("usage");
    let cases = [
        ("score town.mcap", "--trajectory"),
        ("score missing.mcap -t truth.tum", "missing.mcap: no such file"),
        ("score town.mcap -t missing.tum", "missing.tum: no such file"),
        ("score town.mcap -t truth.tum --map missing.las", "missing.las: no such file"),
        ("score town.mcap -t truth.tum --map x=noise.tum", "x=…: no run has this name"),
        ("score town.mcap -t a=truth.tum -t a=noise.tum", "both runs are called `a`"),
        ("score town.mcap -t truth.tum --topic /nope", "`/nope`"),
        ("score town.mcap -t truth.tum --voxel 9 -q", "voxel 9 m"),
        ("score town.mcap -t truth.tum --memory 2", "`2`"),
        ("info missing.mcap", "missing.mcap: no such file"),
    ];
    for (arguments, part) in cases {
        let output = dmp(&folder, arguments);
        assert_eq!((code(&output), text(&output.stdout)), (2, ""), "{arguments}: {output:?}");
        let errors: Vec<&str> =
            text(&output.stderr).lines().filter(|line| line.starts_with("error: ")).collect();
        assert_eq!(errors.len(), 1, "{arguments}: {output:?}");
        assert!(text(&output.stderr).contains(part), "{arguments}: {output:?}");
    }
    std::fs::write(folder.join("cut.tum"), "1.0 0 0 0 0 0 0 1\n2.0 0 0").unwrap();
    let output = dmp(&folder, "score town.mcap -t cut.tum");
    assert_eq!(code(&output), 1);
    assert!(text(&output.stderr).starts_with("error: cut.tum: line 2: 3 columns"), "{output:?}");
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

#[test]
fn info_prints_what_is_in_a_log() {
    let folder = folder("info");
    let output = dmp(&folder, "info town.mcap -t truth.tum --json");
    assert_eq!((code(&output), text(&output.stderr)), (0, ""));
    let info = json(&output);
    assert_eq!(info["schema"], "dmp-info/1");
    let stream = &info["streams"][0];
    let scans = &stream["scans"];
    assert_eq!((&scans["scans"], &scans["rate_hz"]), (&40.into(), &10.0.into()));
    assert_eq!(stream["topic"], info["topics"][0]["name"]);
    assert_eq!(info["trajectories"][0]["pairing"], "by stamp");
    assert_eq!(info["trajectories"][0]["scans_within"], 40);
    let fields: Vec<&str> =
        scans["fields"].as_array().unwrap().iter().map(|field| field["name"].as_str().unwrap()).collect();
    assert_eq!(fields, ["x", "y", "z", "t"]);
    let output = dmp(&folder, "info town.mcap -t truth.tum");
    assert_eq!(code(&output), 0);
    assert!(text(&output.stdout).contains("40 of 40 scans (100.0 %)"), "{output:?}");
}
