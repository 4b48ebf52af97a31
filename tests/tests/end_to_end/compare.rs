//! `dmp compare`: saved results beside each other.

use std::path::Path;

use serde_json::Value;

use crate::common::{dmp, refused, text, unwrapped, workspace, write};

/// Scores these runs of the samples and keeps the JSON as `name`.
fn save(folder: &Path, name: &str, options: &str) -> Value {
    let output = dmp(folder, &format!("score @/town.mcap {options} --json --quiet"));
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    write(folder, name, &text(&output.stdout));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn compare(folder: &Path, arguments: &str) -> (i32, String) {
    let output = dmp(folder, &format!("compare {arguments}"));
    (output.status.code().unwrap(), text(&output.stdout) + &text(&output.stderr))
}

const RUNS: &str = "-t @/truth.tum -t @/drift.tum -t @/noise.tum";

#[test]
fn one_result_is_the_table_again() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let json = save(folder, "a.json", RUNS);
    let table = text(&dmp(folder, &format!("score @/town.mcap {RUNS} --quiet")).stdout);
    assert_eq!(compare(folder, "a.json"), (0, table.clone()));
    // A result is the same however often it is there.
    assert_eq!(compare(folder, "a.json b=a.json"), (0, table));
    let compared: Value = serde_json::from_str(&compare(folder, "a.json --json").1).unwrap();
    assert_eq!(compared["schema"], "dmp-compare/1");
    for field in [
        "runs", "pairs", "drift", "order", "ties", "config", "inputs", "sampling", "timing", "memory",
        "gates",
    ] {
        assert_eq!(compared[field], json[field], "{field}");
    }
    let result = &compared["results"][0];
    assert_eq!((&result["name"], &result["file"]), (&"a".into(), &"a.json".into()));
    assert_eq!(result["runs"], serde_json::json!(["truth", "drift", "noise"]));
    let documented = std::fs::read_to_string(workspace().join("docs/json.md")).unwrap();
    for field in compared.as_object().unwrap().keys().chain(result.as_object().unwrap().keys()) {
        assert!(documented.contains(&format!("`{field}`")), "{field}");
    }
    // It is no result of a score.
    write(folder, "compared.json", &compared.to_string());
    refused(
        folder,
        "compare compared.json",
        1,
        &["compared.json: schema `dmp-compare/1`", "has `dmp-score/2`"],
    );
}

/// The words for what is not decided are names like others.
#[test]
fn a_run_may_be_called_like_a_verdict() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let runs = "-t mixed=@/truth.tum -t undecided=@/drift.tum";
    let json = save(folder, "a.json", runs);
    let pair = &json["pairs"][0];
    assert_eq!((&pair["verdict"], &pair["decided_at_m"]), (&"mixed".into(), &10.0.into()));
    assert!(pair["better_on_the_whole"].is_null());
    let (code, told) = compare(folder, "a.json --expect-best mixed");
    assert!(code == 0 && told.starts_with("mixed is better than undecided.\n"), "{told}");
    let (code, told) = compare(folder, "a.json --expect-best undecided");
    assert!(code == 4 && told.contains("undecided: worse than mixed, at R_cv 10 m"), "{told}");
}

#[test]
fn runs_scored_alike_stand_in_one_table() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let first = save(folder, "first.json", "-t @/truth.tum -t @/drift.tum");
    let second = save(folder, "second.json", "-t @/noise.tum --like first.json");
    assert_eq!(first["config"]["segments"]["starts_scan"], second["config"]["segments"]["starts_scan"]);
    let (code, table) = compare(folder, "first.json second.json");
    assert_eq!(code, 0, "{table}");
    let place = |text: &str| table.find(text).unwrap_or_else(|| panic!("no {text} in\n{table}"));
    assert!(place("\n1  truth") < place("\n2  noise") && place("\n2  noise") < place("\n3  drift"));
    assert!(
        place("  noise  not compared  ")
            < place("\nNot compared: no result holds both runs, nor was each kept")
    );
    assert!(place("\n  truth, noise\n") < place("\n  noise, drift\n"), "{table}");
    // All pairs are of one result, and so is what it says of them.
    let sure = first["promise"]["interval_confidence"].as_f64().unwrap();
    place("\nAt most 1 % of commands tell any two equal runs apart");
    assert!(sure > 0.99 && table.contains(&format!("at {} %", 100.0 * sure)), "{sure} in\n{table}");
    // In one command with the same segments it comes to the same scores.
    let all = save(folder, "all.json", &format!("{RUNS} --like first.json"));
    let (code, json) = compare(folder, "first.json second.json --json");
    let json: Value = serde_json::from_str(&json).unwrap();
    assert_eq!((code, &json["runs"], &json["order"]), (0, &all["runs"], &all["order"]));
    assert_eq!(json["not_compared"], serde_json::json!([["truth", "noise"], ["noise", "drift"]]));
    // A third result that holds the pairs completes it. No error is shared between results.
    let (_, table) = compare(folder, "first.json second.json all.json");
    assert!(
        table.contains("\nAt most 1 % of results tell any two equal runs apart, each by itself"),
        "{table}"
    );
    let (code, json) = compare(folder, "first.json second.json all.json --json");
    let json: Value = serde_json::from_str(&json).unwrap();
    assert_eq!((code, &json["not_compared"]), (0, &serde_json::json!([])));
    assert_eq!(json["pairs"].as_array().unwrap().len(), 3);

    // Gates speak of all of them.
    let gates = "first.json second.json --expect-best truth --fail-above noise:R_cv=9";
    let (code, table) = compare(folder, gates);
    assert_eq!(code, 4);
    for line in [
        "  passed  noise: R_cv 10 m is ",
        "  passed  truth: better than drift, at R_cv 10 m (--expect-best truth)",
        "\ngate failed: truth: not compared with noise: no result holds both, nor was each kept (--expect-best truth)\n",
    ] {
        assert!(table.contains(line), "{line} in\n{table}");
    }
    refused(
        folder,
        "compare first.json --fail-above x:R_cv=9",
        2,
        &["no run is called `x`; the runs are truth, drift"],
    );
}

#[test]
fn runs_of_one_name_are_told_apart() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    save(folder, "monday.json", "-t slam=@/noise.tum -t @/truth.tum");
    save(folder, "tuesday.json", "-t slam=@/drift.tum -t @/truth.tum --like monday.json");
    let (code, table) = compare(folder, "monday.json new=tuesday.json");
    assert_eq!(code, 0, "{table}");
    for line in ["\n1  truth ", "\n2  monday/slam ", "\n3  new/slam ", "\n  monday/slam, new/slam\n"] {
        assert!(table.contains(line), "{line} in\n{table}");
    }
    assert!(table.starts_with("truth is best: better than monday/slam and new/slam.\n"), "{table}");
    refused(folder, "compare x=monday.json x=tuesday.json", 2, &["x"]);
}

#[test]
fn results_that_were_not_made_alike_are_refused_with_the_reason() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    save(folder, "a.json", "-t @/truth.tum --voxel 0.3");
    let alike = "were not made with the same ";
    for (options, words) in [
        ("--voxel 0.5", "settings: config.voxel_m is 0.300048828125 and 0.5"),
        ("--voxel 0.3 --every 2", "frames: config.every is 1 and 2"),
        ("--voxel 0.3 --sample 30", "frames: sampling.frames_scored is 100 and 30"),
        ("--voxel 0.3 --max-range 50", "settings: config.max_range_m is 100 and 50"),
        ("--voxel 0.3 --miss-price 0.2", "settings: config.miss_price is 0.15 and 0.2"),
    ] {
        save(folder, "b.json", &format!("-t @/truth.tum {options}"));
        refused(folder, "compare a.json b.json", 1, &["a.json and b.json ", alike, words]);
    }
    // The way of another run is cut elsewhere.
    save(folder, "b.json", "-t @/noise.tum --voxel 0.3");
    refused(
        folder,
        "compare a.json b.json",
        1,
        &[alike, "segments: config.segments.starts_scan[13] is 80 and 79"],
    );
    // Another log, for which even the settings are the same.
    let town = "simulate town -o other.mcap --scans 40 --azimuth-steps 90 --seed 3 --quiet";
    assert_eq!(dmp(folder, town).status.code(), Some(0));
    let other = dmp(folder, "score other.mcap -t other.truth.tum --json --quiet").stdout;
    write(folder, "other.json", &text(&other));
    refused(folder, "compare a.json other.json", 1, &[alike, "log: inputs.fingerprint is crc32:"]);
    // Before its segments, which begin at scans that only one of the two has.
    for (command, result) in [
        ("score @/town.mcap -t @/truth.tum --like other.json", "other.json"),
        ("score other.mcap -t other.truth.tum --like a.json", "a.json"),
        ("shard plan other.mcap -t other.truth.tum --like a.json -o parts", "a.json"),
    ] {
        refused(folder, command, 1, &[result, "another log", "crc32:"]);
    }
}

#[test]
fn a_result_to_be_like_must_make_sense() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let json = save(
        folder,
        "a.json",
        "-t @/truth.tum --sample 30 --seed 4 --ego=-1,-1,-1,1,1,1 --every 2 --sigma 0.05",
    );
    let like = "score @/town.mcap -t @/noise.tum --like";
    save(folder, "b.json", "-t @/noise.tum --like a.json");
    assert_eq!(compare(folder, "a.json b.json").0, 0);
    let changed = |change: &dyn Fn(&mut Value)| {
        let mut json = json.clone();
        change(&mut json);
        write(folder, "changed.json", &json.to_string());
    };
    changed(&|json| json["config"]["segments"]["starts_scan"][1] = 7.into());
    refused(
        folder,
        &format!("{like} changed.json"),
        2,
        &["segments from scan 7: a segment cannot begin there"],
    );
    changed(&|json| json["config"]["ego"] = "cat".into());
    refused(folder, &format!("{like} changed.json"), 1, &["changed.json: config.ego is `cat`"]);
    changed(&|json| json["config"]["miss_price"] = 2.into());
    refused(folder, &format!("{like} changed.json"), 1, &["changed.json: config.miss_price is 2"]);
    changed(&|json| json["config"]["voxel_m"] = 0.into());
    refused(folder, &format!("{like} changed.json"), 2, &["voxel 0 m"]);
    save(folder, "free.json", "-t @/truth.tum -t @/drift.tum --free-space");
    refused(folder, &format!("{like} free.json"), 1, &["free.json: made with --free-space"]);
    save(folder, "decided.json", "-t @/truth.tum -t @/drift.tum --decide");
    refused(folder, &format!("{like} decided.json"), 1, &["decided.json: made with --decide"]);
    let both = dmp(folder, &format!("{like} a.json --voxel 0.2"));
    assert_eq!(both.status.code(), Some(2));
    assert!(text(&both.stderr).contains("cannot be used with '--voxel"), "{}", text(&both.stderr));
}

#[test]
fn files_that_are_no_results_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let json = save(folder, "a.json", "-t @/truth.tum");
    refused(folder, "compare none.json", 2, &["none.json"]);
    refused(
        folder,
        "compare @/town.mcap",
        1,
        &["town.mcap: message 0: a topic `/points` in `cdr`: no result of `dmp score --keep`"],
    );
    refused(folder, "compare @/scores.json", 1, &["scores.json: missing field `dmp_version`"]);
    std::fs::create_dir(folder.join("folder")).unwrap();
    refused(folder, "compare folder", 1, &["folder: "]);
    // A log that was cut is as cut here.
    let town = std::fs::read(workspace().join("data-samples/town.mcap")).unwrap();
    std::fs::write(folder.join("cut.mcap"), &town[..town.len() - town.len() / 10]).unwrap();
    let cut = dmp(folder, "score cut.mcap -t @/truth.tum --json --quiet");
    assert_eq!(cut.status.code(), Some(3));
    write(folder, "cut.json", &text(&cut.stdout));
    let (code, table) = compare(folder, "cut.json");
    assert!(code == 3 && unwrapped(&table).contains("lost from the log: "), "{code}\n{table}");
    let mut old = json.clone();
    old["runs"][0].as_object_mut().unwrap().remove("r_near_interval_m2");
    write(folder, "old.json", &old.to_string());
    refused(
        folder,
        "compare a.json old.json",
        1,
        &["old.json: missing field `runs[0].r_near_interval_m2`", "score again"],
    );
    let mut later = json.clone();
    later["schema"] = "dmp-score/3".into();
    write(folder, "later.json", &later.to_string());
    refused(folder, "compare later.json", 1, &["later.json: schema `dmp-score/3`"]);
    let mut forged = json;
    forged["order"] = serde_json::json!(["x"]);
    write(folder, "forged.json", &forged.to_string());
    refused(folder, "compare forged.json", 1, &["forged.json: order[0] names `x`"]);
}
