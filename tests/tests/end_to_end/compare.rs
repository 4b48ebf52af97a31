//! `dmp compare`: saved results beside each other; tables as terminals show them.

use std::path::Path;

use serde_json::{Value, json};

use crate::command::assert_documented;
use crate::common::{
    SCORE, TWO, dmp, dmp_command, done, ends, has, once, refused, sample, text, unwrapped, write,
};

/// Scores these runs of the samples and keeps the JSON as `name`.
fn save(folder: &Path, name: &str, options: &str) -> Value {
    let scored = once(&format!("{SCORE} {options} --json --quiet")).stdout();
    write(folder, name, &scored);
    serde_json::from_str(&scored).unwrap()
}

fn compare(folder: &Path, arguments: &str) -> (i32, String) {
    let output = dmp(folder, &format!("compare {arguments}"));
    (output.status.code().unwrap(), text(&output.stdout) + &text(&output.stderr))
}

const TRUTH_AND_DRIFT: &str = "-t @/truth.tum -t @/drift.tum";

#[test]
fn one_result_is_the_table_again() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let json = save(folder, "a.json", TRUTH_AND_DRIFT);
    let table = once(&format!("{TWO} --quiet")).stdout();
    // A result is the same however often it is there.
    for results in ["a.json", "a.json b=a.json"] {
        assert_eq!(compare(folder, results), (0, table.clone()));
    }
    let compared: Value = serde_json::from_str(&compare(folder, "a.json --json").1).unwrap();
    assert_eq!(compared["schema"], "dmp-compare/1");
    for field in [
        "runs", "pairs", "drift", "order", "ties", "config", "inputs", "sampling", "timing", "memory",
        "gates",
    ] {
        assert_eq!(compared[field], json[field], "{field}");
    }
    assert_documented(&compared);
    // It is no result of a score.
    write(folder, "compared.json", &compared.to_string());
    refused(
        folder,
        "compare compared.json",
        1,
        &["compared.json: schema `dmp-compare/1`", "has `dmp-score/3`"],
    );
}

/// The words for what is not decided are names like others.
#[test]
fn a_run_may_be_called_like_a_verdict() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let json = save(folder, "a.json", "-t mixed=@/truth.tum -t undecided=@/drift.tum");
    let pair = &json["pairs"][0];
    assert_eq!((&pair["verdict"], &pair["decided_at_m"]), (&"mixed".into(), &10.0.into()));
    assert!(pair["better_on_the_whole"].is_null());
    assert_eq!(compare(folder, "a.json --expect best:mixed").0, 0);
    assert_eq!(compare(folder, "a.json --expect best:undecided").0, 4);
}

#[test]
fn results_that_were_made_alike_stand_in_one_table() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    save(folder, "first.json", TRUTH_AND_DRIFT);
    save(folder, "second.json", "-t @/noise.tum");
    has(
        &compare(folder, "first.json second.json").1,
        &["\n1  truth", "\n2  noise", "\n3  drift", "not compared"],
    );
    // In one command the scores are the same.
    let all = save(folder, "all.json", &format!("{TRUTH_AND_DRIFT} -t @/noise.tum"));
    let compared = |results: &str| -> Value {
        let (code, json) = compare(folder, &format!("{results} --json"));
        assert_eq!(code, 0, "{json}");
        serde_json::from_str(&json).unwrap()
    };
    let two = compared("first.json second.json");
    let run = |name: &str| all["runs"].as_array().unwrap().iter().find(|run| run["name"] == name).unwrap();
    for of_two in two["runs"].as_array().unwrap() {
        assert_eq!(of_two, run(of_two["name"].as_str().unwrap()));
    }
    assert_eq!(two["order"], all["order"]);
    assert_eq!(two["not_compared"].as_array().unwrap().len(), 2);
    // A third result that holds the pairs completes it.
    let three = compared("first.json second.json all.json");
    assert_eq!((three["pairs"].as_array().unwrap().len(), &three["not_compared"]), (3, &json!([])));
    // Gates hold for all of them.
    let (code, table) = compare(folder, "first.json second.json --expect best:truth --expect noise:R_cv<9");
    assert_eq!(code, 4);
    has(
        &table,
        &[
            "  passed  noise: R_cv 10 m is ",
            "  passed  truth: better than drift",
            "\ngate failed: truth: not compared with noise",
        ],
    );

    // Runs of one name have the names of their results before them.
    save(folder, "monday.json", "-t slam=@/noise.tum -t @/truth.tum");
    save(folder, "tuesday.json", "-t slam=@/drift.tum -t @/truth.tum");
    has(
        &compare(folder, "monday.json new=tuesday.json").1,
        &["\n1  truth ", "\n2  monday/slam ", "\n3  new/slam "],
    );
    refused(folder, "compare x=monday.json x=tuesday.json", 2, &["x"]);
}

#[test]
fn results_that_were_not_made_alike_are_refused_with_the_reason() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    save(folder, "a.json", "-t @/truth.tum --voxel 0.3");
    for (options, reason) in [
        ("-t @/truth.tum --voxel 0.5", "settings: config.voxel_m is 0.300048828125 and 0.5"),
        ("-t @/truth.tum --voxel 0.3 --every 2", "frames: config.every is 1 and 2"),
        ("-t @/truth.tum --voxel 0.3 --returns 1/4", "frames: sampling.returns_one_in is 1 and 4"),
    ] {
        save(folder, "b.json", options);
        refused(folder, "compare a.json b.json", 1, &["a.json and b.json ", reason]);
    }
    // Another log, for which even the settings are the same.
    done(folder, "simulate town -o other.mcap --scans 40 --azimuth-steps 90 --seed 3 --quiet");
    write(folder, "other.json", &done(folder, "score other.mcap -t other.truth.tum --json --quiet"));
    refused(folder, "compare a.json other.json", 1, &["log: inputs.fingerprint is crc32:"]);
}

/// A result in which one value was changed.
fn changed(folder: &Path, json: &Value, pointer: &str, value: Value) {
    let mut json = json.clone();
    *json.pointer_mut(pointer).unwrap() = value;
    write(folder, "changed.json", &json.to_string());
}

#[test]
fn files_that_are_no_results_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let json = save(folder, "a.json", TRUTH_AND_DRIFT);
    std::fs::create_dir(folder.join("folder")).unwrap();
    for (file, code, words) in [
        ("none.json", 2, "none.json"),
        ("@/town.mcap", 1, "town.mcap: message 0"),
        ("@/scores.json", 1, "scores.json: missing field `dmp_version`"),
        ("folder", 1, "folder: "),
    ] {
        refused(folder, &format!("compare {file}"), code, &[words]);
    }
    let mut old = json.clone();
    old["runs"][0].as_object_mut().unwrap().remove("r_near_interval_m2");
    write(folder, "old.json", &old.to_string());
    let words = ["old.json: missing field `runs[0].r_near_interval_m2`", "score again"];
    refused(folder, "compare a.json old.json", 1, &words);
    for (pointer, value, words) in [
        ("/schema", json!("dmp-score/2"), "changed.json: schema `dmp-score/2`"),
        ("/order", json!(["x"]), "changed.json: order[0] names `x`"),
    ] {
        changed(folder, &json, pointer, value);
        refused(folder, "compare changed.json", 1, &[words]);
    }
    // A log that was cut is as cut here, and a gate that fails goes before that.
    let town = std::fs::read(sample("town.mcap")).unwrap();
    std::fs::write(folder.join("cut.mcap"), &town[..town.len() - town.len() / 10]).unwrap();
    let cut = ends(folder, "score cut.mcap -t @/truth.tum --trust --drift=none --json --quiet", 3);
    write(folder, "cut.json", &text(&cut.stdout));
    for (options, code) in [("", 3), ("--expect R_cv<9", 3), ("--expect R_cv<1", 4)] {
        let output = ends(folder, &format!("compare cut.json {options}"), code);
        has(&unwrapped(&text(&output.stdout)), &["lost from the log: "]);
    }
}

/// What `dmp compare` of a saved result prints with these options in an environment.
fn shown(folder: &Path, options: &str, environment: &[(&str, &str)]) -> String {
    let mut command = dmp_command(folder, &format!("compare a.json {options}"));
    let output = command.envs(environment.iter().copied()).output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    text(&output.stdout)
}

#[test]
fn tables_fit_the_terminal_and_have_colours_where_these_are_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    save(path, "a.json", TRUTH_AND_DRIFT);
    let widest = |text: &str| text.lines().map(|line| line.chars().count()).max().unwrap();
    let piped = shown(path, "", &[]);
    assert!(widest(&piped) <= 80 && !piped.contains('\u{1b}'), "{piped}");
    for environment in [("COLUMNS", "none"), ("COLUMNS", "80"), ("NO_COLOR", "1"), ("TERM", "xterm")] {
        assert_eq!(shown(path, "", &[environment]), piped, "{environment:?}");
    }
    let wide = shown(path, "", &[("COLUMNS", "500")]);
    assert!((100..=140).contains(&widest(&wide)), "{wide}");
    let narrow = shown(path, "", &[("COLUMNS", "60")]);
    assert!(widest(&narrow) <= 60, "{narrow}");
    assert!(widest(&shown(path, "-v", &[])) <= 80);

    let mut coloured = shown(path, "", &[("CLICOLOR_FORCE", "1")]);
    has(&coloured, &["\u{1b}[1m", " worse at "]);
    for tone in ["\u{1b}[0m", "\u{1b}[1m", "\u{1b}[31m", "\u{1b}[32m", "\u{1b}[33m"] {
        coloured = coloured.replace(tone, "");
    }
    assert_eq!(coloured, piped);
    let json = shown(path, "--json", &[]);
    assert_eq!(shown(path, "--json", &[("COLUMNS", "140"), ("CLICOLOR_FORCE", "1")]), json);
}
