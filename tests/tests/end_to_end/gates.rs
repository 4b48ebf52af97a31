//! Gates: what ends the command with exit code 4, and how that is reported.

use std::path::Path;
use std::process::{Output, Stdio};

use serde_json::Value;

use crate::command::assert_documented;
use crate::common::{
    SCORE, TWO, dmp, dmp_command, ends, has, misused, once, refused, sample_rows, text, tum, unwrapped, write,
};

/// `dmp compare` of a saved score with gates: as `dmp score` judges them.
fn gated(folder: &Path, options: &str) -> Output {
    write(folder, "a.json", &once(&format!("{TWO} --json --quiet")).stdout());
    dmp(folder, &format!("compare a.json {options}"))
}

#[test]
fn a_gate_that_holds_changes_nothing_but_the_table() {
    let folder = tempfile::tempdir().unwrap();
    let options = "--expect truth:R_cv<3 --expect best:truth --expect coverage>50%";
    let output = ends(folder.path(), &format!("{TWO} --quiet {options}"), 0);
    assert!(output.stderr.is_empty());
    let (table, plain) = (text(&output.stdout), once(&format!("{TWO} --quiet")).stdout());
    assert_eq!(table.strip_prefix(plain.as_str()).unwrap().matches("\n  passed  ").count(), 4);
    assert_eq!(text(&gated(folder.path(), options).stdout), table);
}

#[test]
fn every_failed_gate_is_a_line_and_the_exit_code_is_4() {
    let folder = tempfile::tempdir().unwrap();
    let options = "--expect R_cv_0.5<20cm --expect drift:blocked<20% --expect best:drift --expect unbeaten:drift \
                   --expect revisit>60%";
    let output = gated(folder.path(), options);
    assert_eq!(output.status.code(), Some(4));
    let expected = [
        "drift: R_cv 0.5 m is 42.3 cm, above 20.0 cm",
        "drift: blocked is 40.2 %, above 20.0 %",
        "drift: worse than truth, at R_cv 10 m",
        "drift: worse than truth, at R_cv 10 m",
        "drift: revisit is 48.4 %, below 60.0 %",
    ];
    let stderr = text(&output.stderr);
    assert_eq!(stderr.lines().count(), expected.len(), "{stderr}");
    let table = unwrapped(&text(&output.stdout));
    for (line, expected) in stderr.lines().zip(expected) {
        assert!(line.starts_with(&format!("gate failed: {expected} (")), "{line}");
        has(&table, &[&format!("FAILED {expected}")]);
    }
    has(&table, &["passed truth: R_cv 0.5 m is 14.3 cm, not above 20.0 cm"]);
}

#[test]
fn a_gate_without_another_run_that_can_be_read_fails() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "nan.tum", "1700000000 nan 0 0 0 0 0 1\n");
    let with =
        |others: &str| format!("{SCORE} -t @/drift.tum -t nan.tum {others} --quiet --expect unbeaten:drift");
    let stderr = text(&ends(folder.path(), &with(""), 4).stderr);
    has(
        &stderr,
        &[
            "gate failed: drift: there is no other run to compare with: run `nan` is excluded: nan.tum: line 1",
        ],
    );
    let stderr = text(&ends(folder.path(), &with("-t @/truth.tum"), 4).stderr);
    has(&stderr, &["gate failed: drift: worse than truth"]);
}

#[test]
fn the_json_has_every_gate() {
    let folder = tempfile::tempdir().unwrap();
    let output = gated(folder.path(), "--json --expect R_cv<3 --expect unbeaten:truth");
    assert_eq!(output.status.code(), Some(4));
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_documented(&json["gates"]);
    assert_eq!(json["gates"].as_array().unwrap().len(), 3);
    let without_name = |mut gate: Value| {
        assert!(gate.as_object_mut().unwrap().remove("gate").unwrap().is_string());
        gate
    };
    let root_m = json["runs"][1]["r_cv_m2"]["10"].as_f64().unwrap().sqrt();
    let expected = serde_json::json!({
        "run": "drift", "against": null, "score": "R_cv_10", "value": root_m, "limit": 3.0, "unit": "m", "passed": false,
        "reason": "R_cv 10 m is 3.52 m, above 3.00 m",
    });
    assert_eq!(without_name(json["gates"][1].clone()), expected);
    let expected = serde_json::json!({
        "run": "truth", "against": "drift", "score": null, "value": null, "limit": null, "unit": null, "passed": true,
        "reason": "better than drift, at R_cv 10 m",
    });
    assert_eq!(without_name(json["gates"][2].clone()), expected);
}

#[test]
fn the_same_run_elsewhere_is_the_same_and_another_is_not() {
    let folder = tempfile::tempdir().unwrap();
    let mut rows = sample_rows("truth.tum");
    rows.iter_mut().for_each(|row| row[1] += 432_100.25);
    write(folder.path(), "moved.tum", &tum(&rows));
    let score = |options: &str, code: i32| {
        let output = ends(folder.path(), &format!("{SCORE} -t @/truth.tum {options} --json --quiet"), code);
        (serde_json::from_slice::<Value>(&output.stdout).unwrap(), text(&output.stderr))
    };
    let (same, stderr) = score("-t moved.tum --expect same", 0);
    assert_eq!((&same["pairs"][0]["verdict"], stderr.as_str()), (&"same".into(), ""));
    let (_, stderr) = score("-t @/drift.tum --expect same:drift,truth", 4);
    assert!(stderr.starts_with("gate failed: drift: not the same as truth: up to "), "{stderr}");
    // What is the same is for the user to say.
    let (json, _) = score("-t @/noise.tum --expect same --same-within 5m --confidence 90%", 0);
    let pair = &json["pairs"][0];
    assert_eq!(pair["verdict"], "same");
    assert!(pair["apart"]["within"]["worst_m"].as_f64().unwrap() > 0.04, "{pair}");
    let sure = json["promise"]["interval_confidence"].as_f64().unwrap();
    assert!((sure - 0.975).abs() < 1e-12, "{sure}");
}

#[test]
fn a_score_that_is_not_given_fails_with_the_reason() {
    let folder = tempfile::tempdir().unwrap();
    // Of voxels so small few have three points, and few returns are predicted.
    let score = &format!("{SCORE} -t @/truth.tum --voxel 0.15 --expect R_cv<9 --quiet");
    let output = ends(folder.path(), score, 4);
    has(&text(&output.stderr), &["gate failed: truth: R_cv 10 m is not given: coverage is ", "below 0.5 ("]);
}

#[test]
fn ci_servers_read_annotations_and_junit() {
    let folder = tempfile::tempdir().unwrap();
    gated(folder.path(), "");
    let gates = "compare a.json --expect blocked<20% --expect best:drift --junit gates.xml";
    let output = dmp_command(folder.path(), gates).env("GITHUB_ACTIONS", "true").output().unwrap();
    assert_eq!(output.status.code(), Some(4));
    let expected = [
        "::error title=dmp gate failed::drift: blocked is 40.2 %25, above 20.0 %25 (",
        "::error title=dmp gate failed::drift: worse than truth, at R_cv 10 m (",
    ];
    let stderr = text(&output.stderr);
    assert!(stderr.lines().zip(expected).all(|(line, expected)| line.starts_with(expected)), "{stderr}");
    let xml = std::fs::read_to_string(folder.path().join("gates.xml")).unwrap();
    has(
        &xml,
        &[
            "<testsuites tests=\"3\" failures=\"2\" errors=\"0\" skipped=\"0\" time=\"",
            "<testcase classname=\"truth\" name=\"",
            "<testcase classname=\"drift\" name=\"",
            "<failure type=\"gate\" message=\"blocked is 40.2 %, above 20.0 %\"/>",
            "<failure type=\"gate\" message=\"worse than truth, at R_cv 10 m\"/>",
        ],
    );
}

#[test]
fn a_gate_fails_also_where_nobody_reads_the_table() {
    let folder = tempfile::tempdir().unwrap();
    gated(folder.path(), "");
    let mut command = dmp_command(folder.path(), "compare a.json --expect truth:R_cv<1");
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(4), "{stderr}");
    assert!(
        stderr.starts_with("gate failed: truth: R_cv 10 m is ") && stderr.lines().count() == 1,
        "{stderr}"
    );
}

#[test]
fn gates_that_make_no_sense_are_refused_before_anything_is_read() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["a.tum", "b.tum"] {
        write(folder.path(), name, "1700000000 0 0 0 0 0 0 1\n1700000060 1 0 0 0 0 0 1\n");
    }
    let score = |options: &str| format!("score none.mcap -t a.tum {options}");
    for (options, code, words) in [
        ("--expect c:R_cv<1", 2, "no run is called `c`; the runs are a"),
        ("--expect best:a", 2, "there is no other run to compare with"),
        ("-t b.tum --expect unbeaten:c", 2, "no run is called `c`; the runs are a, b"),
        ("--expect R_cv<1 --junit no/gates.xml", 1, "no: no such folder for --junit"),
    ] {
        refused(folder.path(), &score(options), code, &[words]);
    }
    for (options, words) in [
        ("--expect R_cv_0.5<15", "R_cv 0.5 m is never above 50.0 cm, so this limit cannot fail"),
        ("--expect ate<1", "`ate` is no score; the scores are R_cv_10"),
        ("--expect coverage>0", "coverage is never below 0, so this limit cannot fail"),
        ("--junit gates.xml", "required"),
    ] {
        misused(folder.path(), &score(options), &[words]);
    }
}
