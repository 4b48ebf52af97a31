//! `dmp truth study` on the samples, and the hook that its points come from.

use std::collections::BTreeMap;
use std::sync::Mutex;

use dmp::{Config, FrameSums, RunSums, ScoredReturns, Sink, Watch, evaluate};
use dmp_log::read_trajectory;
use serde_json::Value;

use crate::common::{collapse, dmp, drift, noise, open, runs_of, small_town, text, workspace, write_mcap};

const RUNS: [&str; 4] = ["truth", "drift", "noise", "collapsed"];

fn column(study: &Value, key: &str) -> Vec<Option<f64>> {
    let columns = study["columns"].as_array().unwrap();
    let column = columns.iter().find(|column| column["key"] == key).unwrap_or_else(|| panic!("{key}"));
    column["values"].as_array().unwrap().iter().map(Value::as_f64).collect()
}

/// Kendall's τ-b and Spearman's ρ of values without ties, from their definitions.
fn direct(a: &[f64], b: &[f64]) -> (f64, f64) {
    let n = a.len();
    let mut agreeing = 0.0;
    for i in 0..n {
        for j in 0..i {
            agreeing += ((a[i] - a[j]) * (b[i] - b[j])).signum();
        }
    }
    let rank = |of: &[f64], k: usize| of.iter().filter(|value| **value < of[k]).count() as f64;
    let squares: f64 = (0..n).map(|k| (rank(a, k) - rank(b, k)).powi(2)).sum();
    let n = n as f64;
    (agreeing / (n * (n - 1.0) / 2.0), 1.0 - 6.0 * squares / (n * (n * n - 1.0)))
}

#[test]
fn the_study_of_the_samples_is_what_its_parts_say() {
    let folder = tempfile::tempdir().unwrap();
    let surface = folder.path().join("truth.ply");
    let corners: String =
        (0..4000).fold(String::new(), |text, k| text + &format!("{} {} 0\n", k % 100, k / 100));
    let header = "ply\nformat ascii 1.0\nelement vertex 4000\nproperty double x\nproperty double y\nproperty double z\nend_header\n";
    std::fs::write(&surface, format!("{header}{corners}")).unwrap();
    let output = dmp(
        folder.path(),
        "truth study @/town.mcap -t @/truth.tum -t @/drift.tum -t @/noise.tum -t @/collapsed.tum \
         --reference @/truth.tum --reference-map truth.ply --max-points 40000 --json --plots figures",
    );
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let study: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(study["schema"], "dmp-study/1");
    let fields: Vec<&str> = study.as_object().unwrap().keys().map(String::as_str).collect();
    let mut documented = [
        "schema",
        "dmp_version",
        "runs",
        "columns",
        "correlations",
        "truth",
        "surface",
        "peers",
        "notes",
        "score",
    ];
    documented.sort_unstable();
    assert_eq!(fields, documented);
    assert_eq!(study["runs"], serde_json::json!(RUNS));

    // The scores are those of `dmp score`, which the samples keep to the last bit.
    let kept = std::fs::read_to_string(workspace().join("data-samples/scores.json")).unwrap();
    let kept: Value = serde_json::from_str(&kept).unwrap();
    assert_eq!(study["score"]["runs"], kept["runs"]);
    for (key, path) in [
        ("dmp_sum_m2", vec!["dmp_sum_m2"]),
        ("r_cv_10_m2", vec!["r_cv_m2", "10"]),
        ("r_cv_0.2_m2", vec!["r_cv_m2", "0.2"]),
        ("r_near_0.5_m2", vec!["r_near_m2", "0.5"]),
        ("blocked_rate", vec!["blocked_rate"]),
        ("coverage_revisit", vec!["coverage_revisit"]),
    ] {
        let runs = kept["runs"].as_array().unwrap();
        let expected: Vec<Option<f64>> =
            runs.iter().map(|run| path.iter().fold(run, |value, field| &value[field]).as_f64()).collect();
        assert_eq!(column(&study, key), expected, "{key}");
        assert!(expected.iter().all(Option::is_some));
    }

    // The errors are those of the simulation, which knows what it did.
    let read = |name: &str| {
        read_trajectory(&workspace().join("data-samples").join(format!("{name}.tum"))).unwrap().trajectory
    };
    let truth = read("truth");
    for (name, ate) in RUNS.iter().zip(column(&study, "ate_rmse_m")) {
        let expected = dmp_sim::ate_rmse_m(&read(name), &truth);
        assert!((ate.unwrap() - expected).abs() < 1e-6, "{name} {ate:?} {expected}");
    }
    assert!((column(&study, "ate_rmse_m")[1].unwrap() - 1.0).abs() < 1e-3, "the drift was made 1 m large");

    // What the peers say of the truth is better than of a noisy map.
    for key in ["mme", "mpv_m2"] {
        let values = column(&study, key);
        assert!(values[0] < values[2] && values[0] < values[1], "{key} {values:?}");
    }
    assert!(column(&study, "smd_mean_m").iter().all(|m| m.is_some_and(|m| m > 0.0 && m <= 1.0)));

    let correlations = study["correlations"].as_array().unwrap();
    assert_eq!(correlations.len(), 21 * 20 / 2);
    let mut compared = 0;
    for correlation in correlations {
        let [a, b] = ["a", "b"].map(|side| column(&study, correlation[side].as_str().unwrap()));
        let (a, b): (Vec<f64>, Vec<f64>) = a.into_iter().zip(b).filter_map(|(a, b)| a.zip(b)).unzip();
        let tied = |values: &[f64]| (0..values.len()).any(|k| values[..k].contains(&values[k]));
        if a.len() < 3 || tied(&a) || tied(&b) {
            continue;
        }
        let (tau, rho) = direct(&a, &b);
        assert!((correlation["kendall_tau_b"].as_f64().unwrap() - tau).abs() < 1e-12, "{correlation}");
        assert!((correlation["spearman_rho"].as_f64().unwrap() - rho).abs() < 1e-12, "{correlation}");
        compared += 1;
    }
    assert!(compared > 150, "{compared}");

    let pictures: Vec<_> = std::fs::read_dir(folder.path().join("figures")).unwrap().collect();
    // Seventeen scores against ATE and SMD, and the curves.
    assert_eq!(pictures.len(), 2 * 17 + 1);
    for picture in pictures {
        let path = picture.unwrap().path();
        let svg = std::fs::read_to_string(&path).unwrap();
        let points = svg.matches("<circle").count();
        assert!(well_formed(&svg) && points >= 3, "{}", path.display());
    }
}

/// Whether tags are closed in order, attributes quoted and characters escaped.
fn well_formed(xml: &str) -> bool {
    let mut open: Vec<&str> = Vec::new();
    let mut rest = xml.trim_end();
    while let Some(start) = rest.find('<') {
        let (before, tag) = rest.split_at(start);
        let entity =
            |part: &str| part.split_once(';').is_some_and(|(name, _)| name.len() <= 5 && !name.is_empty());
        let Some(end) = tag.find('>') else { return false };
        if before.contains('>') || !before.split('&').skip(1).all(entity) {
            return false;
        }
        let inside = &tag[1..end];
        rest = &tag[end + 1..];
        if let Some(name) = inside.strip_prefix('/') {
            if open.pop() != Some(name) {
                return false;
            }
        } else if inside.matches('"').count() % 2 != 0 || inside.contains('<') {
            return false;
        } else if !inside.ends_with('/') {
            open.push(inside.split_whitespace().next().unwrap_or_default());
        }
    }
    open.is_empty() && rest.is_empty() && xml.starts_with("<svg ")
}

#[test]
fn the_check_of_pictures_sees_faults() {
    assert!(well_formed("<svg a=\"b\"><g><p/></g>x &amp; y</svg>\n"));
    for broken in
        ["<svg ><g></svg>", "<svg a=\"b></svg>", "<svg >a & b</svg>", "<svg ></svg>x", "<svg >a > b</svg>"]
    {
        assert!(!well_formed(broken), "{broken}");
    }
}

#[test]
fn few_runs_and_strangers_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let floor = "v -200 -200 0\nv 200 -200 0\nv 200 200 0\nv -200 200 0\nf 1 2 3 4\n";
    std::fs::write(folder.path().join("floor.obj"), floor).unwrap();
    let runs = "-t @/truth.tum -t @/drift.tum -t @/noise.tum -t @/collapsed.tum --reference @/truth.tum";
    let output =
        dmp(folder.path(), &format!("truth study @/town.mcap --every 10 --reference-map floor.obj {runs}"));
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let table = text(&output.stdout);
    assert!(table.contains("MOM") && table.contains("SMD median"), "{table}");
    assert!(table.lines().all(|line| line.chars().count() <= 100), "{table}");

    let study = "truth study @/town.mcap --every 10 --no-peers";
    let output =
        dmp(folder.path(), &format!("{study} -t @/truth.tum -t @/noise.tum --reference @/truth.tum"));
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let table = text(&output.stdout);
    assert!(table.contains("no agreement can be told: 2 of the runs have both, 3 are needed"), "{table}");
    assert!(table.lines().all(|line| line.chars().count() <= 100), "{table}");
    assert!(!table.contains("MME"));

    let shifted: String = std::fs::read_to_string(workspace().join("data-samples/truth.tum"))
        .unwrap()
        .lines()
        .filter(|line| !line.starts_with('#'))
        .fold(String::new(), |text, line| text + "2" + &line[1..] + "\n");
    std::fs::write(folder.path().join("later.tum"), shifted).unwrap();
    let output = dmp(folder.path(), &format!("{study} -t @/truth.tum -t @/noise.tum --reference later.tum"));
    assert_eq!(output.status.code(), Some(1));
    let error = text(&output.stderr);
    assert!(
        error.lines().last().unwrap().contains("run `truth` cannot be compared with the reference"),
        "{error}"
    );

    for (arguments, code) in [
        ("--reference no-such.tum", 2),
        ("--reference @/truth.tum --rpe-delta 0", 2),
        ("--reference @/truth.tum --reference-map no-such.ply", 2),
        ("", 2),
    ] {
        let output = dmp(folder.path(), &format!("{study} -t @/truth.tum {arguments}"));
        assert_eq!(output.status.code(), Some(code), "{arguments} {}", text(&output.stderr));
    }
}

/// Adds the returns up again as they come by.
#[derive(Default)]
struct Again {
    runs: Mutex<BTreeMap<usize, Vec<RunSums>>>,
    frames: Mutex<BTreeMap<usize, Vec<RunSums>>>,
}

impl Sink for Again {
    fn returns_scored(&self, returns: &ScoredReturns<'_>) {
        let mut frames = self.runs.lock().unwrap();
        let sums = frames.entry(returns.frame).or_default();
        sums.resize_with(returns.runs.len(), RunSums::default);
        for (run, sums) in returns.runs.iter().zip(sums) {
            assert_eq!(
                (run.residuals.len(), run.rays.len()),
                (returns.offsets_ns.len(), returns.offsets_ns.len())
            );
            run.residuals.iter().for_each(|residuals| sums.add(residuals));
        }
    }

    fn frame_scored(&self, frame: usize, sums: &FrameSums) {
        self.frames.lock().unwrap().insert(frame, sums.runs());
    }
}

#[test]
fn every_scored_return_comes_by_the_watch() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("town.mcap");
    let (scans, truth) = small_town(40, 90);
    write_mcap(&path, &scans);
    let runs =
        runs_of(&truth, &[("noise", noise(0.05, 0.1)), ("drift", drift(1.0)), ("half", collapse(0.5))]);
    let again = Again::default();
    let config = Config { threads: 3, ..Config::default() };
    let report = evaluate(open(&path).as_ref(), &runs, &config, Watch::sink(&again)).unwrap();
    let by_return = again.runs.into_inner().unwrap();
    assert_eq!(by_return, again.frames.into_inner().unwrap());
    assert_eq!(by_return.len(), report.inputs.scans_used);
    for (run, scores) in report.runs.iter().enumerate() {
        let mut sums = RunSums::default();
        by_return.values().for_each(|frame| sums.merge(&frame[run]));
        assert_eq!(sums.returns(), scores.returns);
        assert_eq!(sums.dmp_sum_m2(), scores.dmp_sum_m2);
        assert_eq!(sums.r_near_m2()[2].1, scores.r_near_m2[2]);
        assert_eq!(sums.coverage(), scores.coverage);
        assert!(sums.with_first() > 0);
    }
}
