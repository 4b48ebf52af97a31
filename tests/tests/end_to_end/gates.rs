//! Gates: what ends the command with exit code 4, and how that is told.

use std::process::{Command, Stdio};

use serde_json::Value;

use crate::common::{dmp, refused, text, unwrapped, write};

const TWO: &str = "score @/town.mcap -t @/truth.tum -t @/drift.tum --quiet";

/// Exit code, standard output and the lines on standard error.
fn gated(options: &str) -> (i32, String, Vec<String>) {
    let folder = tempfile::tempdir().unwrap();
    let output = dmp(folder.path(), &format!("{TWO} {options}"));
    let lines = text(&output.stderr).lines().map(str::to_owned).collect();
    (output.status.code().unwrap(), text(&output.stdout), lines)
}

#[test]
fn a_gate_that_holds_changes_nothing_but_the_table() {
    let (code, plain, lines) = gated("");
    assert_eq!((code, lines.len()), (0, 0), "{lines:?}");
    let (code, table, lines) =
        gated("--fail-above truth:R_cv=3 --expect-best truth --fail-below coverage=50%");
    assert_eq!((code, lines.len()), (0, 0), "{lines:?}");
    let gates = table.strip_prefix(plain.as_str()).unwrap();
    let gates = gates.lines().skip(2).filter(|line| !line.starts_with("    "));
    let gates: Vec<&str> = gates.map(|line| &line[..8]).collect();
    assert_eq!(gates, ["  passed"; 4]);
}

#[test]
fn every_failed_gate_is_a_line_and_the_exit_code_is_4() {
    let options = "--fail-above R_cv_0.5=20cm --fail-above drift:blocked=20% --expect-best drift \
                   --expect-unbeaten drift --fail-below revisit=50%";
    let (code, table, lines) = gated(options);
    assert_eq!(code, 4);
    let expected = [
        "gate failed: drift: R_cv 0.5 m is 44.5 cm, above 20.0 cm (--fail-above R_cv_0.5=20cm)",
        "gate failed: drift: blocked is 33.6 %, above 20.0 % (--fail-above drift:blocked=20%)",
        "gate failed: drift: revisit is 36.3 %, below 50.0 % (--fail-below revisit=50%)",
        "gate failed: drift: worse than truth, at R_cv 10 m (--expect-best drift)",
        "gate failed: drift: worse than truth, at R_cv 10 m (--expect-unbeaten drift)",
    ];
    assert_eq!(lines, expected);
    for line in expected {
        let line = line.replace("gate failed: ", "FAILED ");
        assert!(unwrapped(&table).contains(&line), "{line} in\n{table}");
    }
    assert!(table.contains("  passed  truth: R_cv 0.5 m is 14.7 cm, not above 20.0 cm"), "{table}");
}

#[test]
fn a_change_that_changes_nothing_is_told_from_one_that_does() {
    let folder = tempfile::tempdir().unwrap();
    let truth = std::fs::read_to_string(crate::common::workspace().join("data-samples/truth.tum")).unwrap();
    let moved = truth.lines().filter(|line| !line.starts_with('#')).map(|line| {
        let mut columns: Vec<String> = line.split(' ').map(str::to_owned).collect();
        columns[1] = format!("{:.9}", columns[1].parse::<f64>().unwrap() + 432_100.25);
        columns.join(" ") + "\n"
    });
    write(folder.path(), "moved.tum", &moved.collect::<String>());
    let score = |options: &str| {
        let output = dmp(folder.path(), &format!("score @/town.mcap -t @/truth.tum {options} --quiet"));
        (output.status.code(), text(&output.stdout), text(&output.stderr))
    };
    let (code, table, stderr) = score("-t moved.tum --expect-same --same-within 1%");
    assert_eq!((code, stderr.as_str()), (Some(0), ""));
    assert!(table.starts_with("truth and moved are the same, for practical purposes.\n"), "{table}");

    let (code, _, stderr) = score("-t @/drift.tum --expect-same=drift,truth");
    assert_eq!(code, Some(4), "{stderr}");
    let expected = "gate failed: drift: not the same as truth: up to ";
    assert!(stderr.starts_with(expected) && stderr.lines().count() == 1, "{stderr}");
    // Better beyond doubt, and by less than what somebody calls the same.
    let (code, json, stderr) = score("-t @/noise.tum --expect-same --same-within 5m --confidence 90% --json");
    assert_eq!((code, stderr.as_str()), (Some(0), ""));
    let json: Value = serde_json::from_str(&json).unwrap();
    let pair = &json["pairs"][0];
    assert_eq!((pair["verdict"].as_str(), pair["is_same"].as_bool()), (Some("truth"), Some(true)));
    let sure = json["promise"]["interval_confidence"].as_f64().unwrap();
    assert!((sure - 0.975).abs() < 1e-12, "{sure}");
}

#[test]
fn the_json_has_every_gate() {
    let (code, json, _) = gated("--json");
    let json: Value = serde_json::from_str(&json).unwrap();
    assert_eq!((code, &json["gates"]), (0, &Value::Array(Vec::new())));
    let (code, json, lines) = gated("--json --fail-above R_cv=3 --expect-unbeaten truth");
    assert_eq!((code, lines.len()), (4, 1), "{lines:?}");
    let json: Value = serde_json::from_str(&json).unwrap();
    let gates = json["gates"].as_array().unwrap();
    assert_eq!(gates.len(), 3);
    let root_m = json["runs"][1]["r_cv_m2"]["10"].as_f64().unwrap().sqrt();
    let expected = serde_json::json!({
        "gate": "--fail-above R_cv=3", "run": "drift", "against": null, "score": "R_cv_10", "value": root_m,
        "limit": 3.0, "unit": "m", "passed": false, "reason": "R_cv 10 m is 3.51 m, above 3.00 m",
    });
    assert_eq!(gates[1], expected);
    let expected = serde_json::json!({
        "gate": "--expect-unbeaten truth", "run": "truth", "against": "drift", "score": null, "value": null,
        "limit": null, "unit": null, "passed": true, "reason": "better than drift, at R_cv 10 m",
    });
    assert_eq!(gates[2], expected);
    let documented = std::fs::read_to_string(crate::common::workspace().join("docs/json.md")).unwrap();
    for field in gates[0].as_object().unwrap().keys() {
        assert!(documented.contains(&format!("`{field}`")), "{field}");
    }
}

#[test]
fn a_score_that_is_not_given_fails_with_the_reason() {
    let folder = tempfile::tempdir().unwrap();
    // Of voxels so small few have three points, and few returns are predicted.
    let score = "score @/town.mcap -t @/truth.tum --voxel 0.15 --fail-above R_cv=9 --quiet";
    let output = dmp(folder.path(), score);
    assert_eq!(output.status.code(), Some(4), "{}", text(&output.stderr));
    let line = text(&output.stderr);
    let expected = "gate failed: truth: R_cv 10 m is not given: coverage is ";
    assert!(line.starts_with(expected) && line.ends_with("below 0.5 (--fail-above R_cv=9)\n"), "{line}");
}

#[test]
fn ci_servers_are_told_in_their_ways() {
    let folder = tempfile::tempdir().unwrap();
    let options = "--fail-above blocked=20% --expect-best drift --annotate github --junit gates.xml";
    let output = dmp(folder.path(), &format!("{TWO} {options}"));
    assert_eq!(output.status.code(), Some(4));
    let expected = "::error title=dmp gate failed::drift: blocked is 33.6 %25, above 20.0 %25 (--fail-above blocked=20%25)\n\
                    ::error title=dmp gate failed::drift: worse than truth, at R_cv 10 m (--expect-best drift)\n";
    assert_eq!(text(&output.stderr), expected);
    let xml = std::fs::read_to_string(folder.path().join("gates.xml")).unwrap();
    let (head, cases) = xml.split_once("    <testcase").unwrap();
    assert!(
        head.contains("<testsuites tests=\"3\" failures=\"2\" errors=\"0\" skipped=\"0\" time=\""),
        "{xml}"
    );
    assert!(head.contains("town.mcap\" tests=\"3\""), "{xml}");
    let expected = r#" classname="truth" name="--fail-above blocked=20%: truth" time="0"/>
    <testcase classname="drift" name="--fail-above blocked=20%: drift" time="0">
      <failure type="gate" message="blocked is 33.6 %, above 20.0 %"/>
    </testcase>
    <testcase classname="drift" name="--expect-best drift: drift against truth" time="0">
      <failure type="gate" message="worse than truth, at R_cv 10 m"/>
    </testcase>
  </testsuite>
</testsuites>
"#;
    assert_eq!(cases, expected);
}

#[test]
fn a_failed_gate_goes_before_damage() {
    let folder = tempfile::tempdir().unwrap();
    let whole = std::fs::read(crate::common::workspace().join("data-samples/town.mcap")).unwrap();
    std::fs::write(folder.path().join("cut.mcap"), &whole[..whole.len() - whole.len() / 10]).unwrap();
    for (limit, code) in [("9", 3), ("1", 4)] {
        let score = format!("score cut.mcap -t @/truth.tum --fail-above R_cv={limit}");
        let output = dmp(folder.path(), &score);
        assert_eq!(output.status.code(), Some(code), "{}", text(&output.stderr));
        assert!(unwrapped(&text(&output.stdout)).contains("lost from the log: "), "{}", text(&output.stdout));
    }
}

#[test]
fn a_gate_fails_also_where_nobody_reads_the_table() {
    let samples = crate::common::workspace().join("data-samples");
    let mut child = Command::new(env!("CARGO_BIN_EXE_dmp-under-test"))
        .args(["score", "town.mcap", "-t", "truth.tum", "--fail-above", "R_cv=1", "--quiet"])
        .current_dir(samples)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    let lines = text(&output.stderr);
    assert_eq!(output.status.code(), Some(4), "{lines}");
    assert!(lines.starts_with("gate failed: truth: R_cv 10 m is ") && lines.lines().count() == 1, "{lines}");
}

#[test]
fn gates_that_make_no_sense_are_refused_before_anything_is_read() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "a.tum", "1700000000 0 0 0 0 0 0 1\n1700000060 1 0 0 0 0 0 1\n");
    write(folder.path(), "b.tum", "1700000000 0 0 0 0 0 0 1\n1700000060 1 0 0 0 0 0 1\n");
    let refused = |options: &str, code: i32, words: &[&str]| {
        refused(folder.path(), &format!("score none.mcap -t a.tum {options}"), code, words);
    };
    refused("--fail-above c:R_cv=1", 2, &["--fail-above c:R_cv=1: no run is called `c`; the runs are a"]);
    refused("--expect-best a", 2, &["--expect-best a: there is no other run to compare with"]);
    refused(
        "-t b.tum --expect-unbeaten c",
        2,
        &["--expect-unbeaten c: no run is called `c`; the runs are a, b"],
    );
    refused("--fail-above R_cv=1 --junit no/gates.xml", 1, &["no: no such folder for --junit"]);
    for (options, words) in [
        ("--fail-above R_cv_0.5=15", "R_cv 0.5 m is never above 50.0 cm, so this limit cannot fail"),
        ("--fail-above ate=1", "`ate` is no score; there are R_cv_10"),
        ("--fail-below coverage=0", "coverage is never below 0, so this limit cannot fail"),
        ("--junit gates.xml", "required"),
        ("--annotate github", "required"),
        ("--annotate gitlab --fail-above R_cv=1", "possible values: github"),
    ] {
        let output = dmp(folder.path(), &format!("score none.mcap -t a.tum {options}"));
        assert_eq!((output.status.code(), text(&output.stdout)), (Some(2), String::new()), "{options}");
        assert!(text(&output.stderr).contains(words), "{options}: {}", text(&output.stderr));
    }
}
