//! `dmp truth ape` and `dmp truth rpe` beside evo's numbers: those of the conformance script's small
//! cases, kept in a file, and the published ones of KITTI 00.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde::Deserialize;

use crate::common::workspace;

#[derive(Debug, Deserialize)]
struct Golden {
    evo: String,
    cases: Vec<Case>,
}

#[derive(Debug, Deserialize)]
struct Case {
    name: String,
    metric: String,
    word: String,
    reference: String,
    estimate: String,
    options: Vec<String>,
    /// What evo prints; `None` where it fails.
    text: Option<String>,
    stats: Option<BTreeMap<String, f64>>,
}

/// The JSON as documented: a field that is missing, or one that is not documented, fails here.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(dead_code, reason = "every field must be there; not every one is asserted on")]
struct Report {
    schema: String,
    dmp_version: String,
    metric: String,
    title: String,
    relation: String,
    unit: String,
    reference: Input,
    estimate: Input,
    pairs: Option<Pairs>,
    alignment: Option<[[f64; 4]; 4]>,
    errors: usize,
    stats: BTreeMap<String, f64>,
    notes: Vec<String>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(dead_code, reason = "every field must be there; not every one is asserted on")]
struct Input {
    path: String,
    format: String,
    poses: usize,
    poses_compared: usize,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(dead_code, reason = "every field must be there; not every one is asserted on")]
#[expect(clippy::struct_field_names, reason = "the names are those of the JSON")]
struct Pairs {
    delta: f64,
    delta_unit: String,
    delta_tol: f64,
    all_pairs: bool,
    from_reference: bool,
}

fn dmp(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_dmp-under-test")).args(arguments).current_dir(folder).output().unwrap()
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).unwrap()
}

/// Equal to 10⁻⁹, or rounding of what should be zero.
fn near(a: f64, b: f64, largest: f64) -> bool {
    (a - b).abs() <= (1e-9 * a.abs().max(b.abs())).max(1e-12 * largest)
}

#[test]
fn numbers_and_text_are_evos() {
    let file = workspace().join("tests/conformance/evo/golden.json");
    let golden: Golden = serde_json::from_slice(&std::fs::read(file).unwrap()).unwrap();
    assert_eq!(golden.evo, "1.38.1");
    assert!(golden.cases.len() > 60 && golden.cases.iter().any(|case| case.stats.is_none()));
    let folder = tempfile::tempdir().unwrap();
    for case in &golden.cases {
        std::fs::write(folder.path().join("reference"), &case.reference).unwrap();
        std::fs::write(folder.path().join("estimate"), &case.estimate).unwrap();
        let mut arguments = vec!["truth", &case.metric, &case.word, "reference", "estimate"];
        arguments.extend(case.options.iter().map(String::as_str));
        let printed = dmp(folder.path(), &arguments);
        arguments.push("--json");
        let json = dmp(folder.path(), &arguments);
        let Some(stats) = &case.stats else {
            assert!(matches!(json.status.code(), Some(1 | 2)) && json.stdout.is_empty(), "{}", case.name);
            let errors = text(&json.stderr).lines().filter(|line| line.starts_with("error: ")).count();
            assert_eq!(errors, 1, "{}: {}", case.name, text(&json.stderr));
            continue;
        };
        assert_eq!(json.status.code(), Some(0), "{}: {}", case.name, text(&json.stderr));
        let report: Report = serde_json::from_slice(&json.stdout).unwrap();
        assert_eq!((report.schema.as_str(), &report.metric), ("dmp-truth/1", &case.metric));
        assert_eq!(report.stats.keys().collect::<Vec<_>>(), stats.keys().collect::<Vec<_>>());
        let largest = stats["max"].max(1.0);
        for (name, evo) in stats {
            let largest = if name == "sse" { largest * largest } else { largest };
            let ours = report.stats[name];
            assert!(near(ours, *evo, largest), "{} {name}: evo {evo} dmp {ours}", case.name);
        }
        assert_eq!(text(&printed.stdout), case.text.as_deref().unwrap_or_default(), "{}", case.name);
    }
}

#[test]
fn a_format_is_found_by_looking() {
    let folder = tempfile::tempdir().unwrap();
    let tum = "0.5 0 0 0 0 0 0 1\n1.5 1 0 0 0 0 0 1\n2.5 1 1 0 0 0 0 1\n";
    let euroc =
        "#timestamp [ns], p\n500000000,0,0,0,1,0,0,0\n1500000000,1,0,0,1,0,0,0\n2500000000,1,1,0,1,0,0,0\n";
    std::fs::write(folder.path().join("a.tum"), tum).unwrap();
    std::fs::write(folder.path().join("b.csv"), euroc).unwrap();
    let found = dmp(folder.path(), &["truth", "ape", "b.csv", "a.tum", "-as", "--json"]);
    let report: Report = serde_json::from_slice(&found.stdout).unwrap();
    assert_eq!((report.reference.format.as_str(), report.estimate.format.as_str()), ("EuRoC", "TUM"));
    assert!(report.stats["max"] < 1e-12 && report.alignment.is_some());

    for (arguments, code, says) in [
        (&["truth", "ape", "xyz", "b.csv", "a.tum"][..], 2, "`xyz` is no format"),
        (&["truth", "ape", "kitti", "a.tum", "a.tum"], 1, "a.tum: line 1: 8 columns"),
        (&["truth", "ape", "a.tum", "none.tum"], 2, "none.tum"),
        (&["truth", "ape", "a.tum", "a.tum", "-a", "--align_origin"], 2, "cannot be used with"),
        (&["truth", "rpe", "a.tum", "a.tum", "-d", "1.5"], 2, "delta 1.5 frames"),
    ] {
        let output = dmp(folder.path(), arguments);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {}", text(&output.stderr));
        assert!(text(&output.stderr).contains(says), "{}", text(&output.stderr));
    }
}

#[test]
fn a_result_file_is_written_once_and_always_the_same() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.tum"), "0 0 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n2 2 1 0 0 0 0 1\n")
        .unwrap();
    let save =
        ["truth", "rpe", "a.tum", "a.tum", "--save_results", "out.zip", "--save_traj_in_zip", "--silent"];
    let first = dmp(folder.path(), &save);
    assert_eq!((first.status.code(), first.stdout.len()), (Some(0), 0), "{}", text(&first.stderr));
    let bytes = std::fs::read(folder.path().join("out.zip")).unwrap();
    for part in ["info.json", "stats.json", "error_array.npy", "timestamps.npy", "a.tum.tum"] {
        assert!(bytes.windows(part.len()).any(|window| window == part.as_bytes()), "{part}");
    }
    let again = dmp(folder.path(), &save);
    assert_eq!(again.status.code(), Some(2));
    assert!(text(&again.stderr).contains("out.zip: there is a file"));
    let forced = dmp(folder.path(), &[&save[..], &["--no_warnings"]].concat());
    assert_eq!(forced.status.code(), Some(0));
    assert_eq!(std::fs::read(folder.path().join("out.zip")).unwrap(), bytes);
}

/// The figures that evo's users know for ORB-SLAM on KITTI 00.
#[test]
fn the_published_figures_of_kitti_00() {
    let Some(folder) = std::env::var_os("DMP_EVO_DATA").map(PathBuf::from) else {
        println!("skipped: DMP_EVO_DATA is not set to evo's test/data, so KITTI_00_*.txt cannot be read");
        return;
    };
    let rmse = |metric: &str, options: &str| {
        let mut arguments = vec!["truth", metric, "kitti", "KITTI_00_gt.txt", "KITTI_00_ORB.txt"];
        arguments.extend(options.split_whitespace());
        let output = dmp(&folder, &arguments);
        let line = text(&output.stdout).lines().find_map(|line| line.trim().strip_prefix("rmse\t"));
        line.unwrap_or_else(|| panic!("{}", text(&output.stderr))).to_owned()
    };
    for (options, figure) in [("", "7.790289"), ("-a", "1.303450"), ("-as", "0.937709"), ("-s", "7.380186")] {
        assert_eq!(rmse("ape", options), figure, "{options}");
    }
    for (options, figure) in [
        ("", "0.028120"),
        ("-d 10 -u f", "0.194008"),
        ("-d 100 -u m", "1.193976"),
        ("-d 100 -u m --all_pairs", "1.254830"),
    ] {
        assert_eq!(rmse("rpe", options), figure, "{options}");
    }
}
