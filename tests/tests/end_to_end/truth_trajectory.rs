//! `dmp truth ape` and `dmp truth rpe` beside evo's numbers: those of the conformance script's small
//! cases, kept in a file, and the published ones of KITTI 00.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde::Deserialize;

use crate::command::assert_documented;
use crate::common::{PROGRAM, done, ends, has, json, json_of, text, workspace, write};

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

fn dmp(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(PROGRAM).args(arguments).current_dir(folder).output().unwrap()
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
        let report = json_of(&json);
        assert_documented(&report);
        assert_eq!(
            (&report["schema"], &report["metric"]),
            (&"dmp-truth/1".into(), &case.metric.clone().into())
        );
        let ours = report["stats"].as_object().unwrap();
        assert_eq!(ours.keys().collect::<Vec<_>>(), stats.keys().collect::<Vec<_>>());
        let largest = stats["max"].max(1.0);
        for (name, evo) in stats {
            let largest = if name == "sse" { largest * largest } else { largest };
            let ours = ours[name].as_f64().unwrap();
            assert!(near(ours, *evo, largest), "{} {name}: evo {evo} dmp {ours}", case.name);
        }
        assert_eq!(text(&printed.stdout), case.text.as_deref().unwrap_or_default(), "{}", case.name);
    }
}

#[test]
fn a_format_is_found_by_looking() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    write(path, "a.tum", "0.5 0 0 0 0 0 0 1\n1.5 1 0 0 0 0 0 1\n2.5 1 1 0 0 0 0 1\n");
    let lines = ["500000000,0,0,0,1,0,0,0", "1500000000,1,0,0,1,0,0,0", "2500000000,1,1,0,1,0,0,0"];
    write(path, "b.csv", &format!("#timestamp [ns], p\n{}\n", lines.join("\n")));
    let report = json(path, "truth ape b.csv a.tum -as");
    assert_eq!(
        (&report["reference"]["format"], &report["estimate"]["format"]),
        (&"EuRoC".into(), &"TUM".into())
    );
    assert!(report["stats"]["max"].as_f64().unwrap() < 1e-12 && report["alignment"].is_array());

    for (arguments, code, words) in [
        ("ape xyz b.csv a.tum", 2, "`xyz` is no format"),
        ("ape kitti a.tum a.tum", 1, "a.tum: line 1: 8 columns"),
        ("ape a.tum none.tum", 2, "none.tum"),
        ("ape a.tum a.tum -a --align_origin", 2, "cannot be used with"),
        ("rpe a.tum a.tum -d 1.5", 2, "delta 1.5 frames"),
    ] {
        has(&text(&ends(path, &format!("truth {arguments}"), code).stderr), &[words]);
    }
    // A result file is never overwritten.
    done(path, "truth rpe a.tum a.tum --save_results out.zip");
    let bytes = std::fs::read(path.join("out.zip")).unwrap();
    for part in ["info.json", "stats.json", "error_array.npy", "timestamps.npy"] {
        assert!(bytes.windows(part.len()).any(|window| window == part.as_bytes()), "{part}");
    }
    let again = ends(path, "truth rpe a.tum a.tum --save_results out.zip", 2);
    has(&text(&again.stderr), &["out.zip: the file exists"]);
    assert_eq!(std::fs::read(path.join("out.zip")).unwrap(), bytes);
}

/// Where not all poses of the shorter trajectory have a partner, how many do is printed.
#[test]
fn the_number_of_poses_with_a_partner_is_printed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let tum = |stamps_s: &[f64]| -> String {
        stamps_s.iter().map(|s| format!("{s:.6} {} {} 0 0 0 0 1\n", s.sin(), s % 7.0)).collect()
    };
    let estimate_s: Vec<f64> = (0..400).map(|k| 1000.0 + 0.05 * f64::from(k)).collect();
    write(path, "estimate.tum", &tum(&estimate_s));
    let each_s = |drift: &dyn Fn(i32) -> f64| -> Vec<f64> {
        (0..20).map(|k| 1000.0 + f64::from(k) + drift(k)).collect()
    };
    for (what, reference_s) in [
        ("a clock that drifts", each_s(&|k| 0.003 * f64::from(k - 10))),
        ("a clock that steps", each_s(&|k| if k < 7 { 0.002 } else { 0.022 })),
        ("jitter", each_s(&|k| f64::from(k * 7 % 20) / 1000.0 + 0.0005)),
        ("another span", each_s(&|k| 5.0 + 0.004 * f64::from(k % 2))),
        ("a stray stamp", each_s(&|k| if k == 3 { 0.5123 } else { 0.0 } + 0.001)),
        ("a gap", each_s(&|k| if k > 9 { 4000.0 } else { 0.0 })),
        ("all of them", each_s(&|_| 0.001)),
    ] {
        write(path, "reference.tum", &tum(&reference_s));
        let has_partner = |s: &&f64| estimate_s.iter().any(|other| (*s - other).abs() <= 0.01);
        let (paired, all) = (reference_s.iter().filter(has_partner).count(), reference_s.len());
        for command in [
            "ape reference.tum estimate.tum",
            "ape estimate.tum reference.tum",
            "rpe reference.tum estimate.tum",
        ] {
            let stderr = text(&ends(path, &format!("truth {command}"), 0).stderr);
            let words = format!("reference.tum: {paired} of {all} poses have a partner within 0.01 s");
            assert_eq!(stderr.contains(&words), paired < all, "{what}, {command}: {words}\n{stderr}");
        }
        assert_eq!(paired == all, what == "all of them", "{what}: {paired}");
    }
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
        let stdout = text(&output.stdout);
        let line = stdout.lines().find_map(|line| line.trim().strip_prefix("rmse\t"));
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
