//! Reports made by hand, for tests: the scores of the sample data with other runs, pairs and numbers.

use dmp::{Basis, PairReport, Report, RunReport, ScaleReport, ScaleScores, Verdict, Withheld};
use serde_json::{Value, json};

/// Truth and noise undecided, drift worse, and mixed against noise.
pub(crate) fn three_runs() -> Report {
    let mut drift = run("drift", 2.0);
    drift.coverage = Some(0.431);
    let why = "coverage is 0.431, below 0.5";
    withhold(&mut drift, why);
    drift.warnings = vec![
        "R_cv is not given: coverage is 43.1 %, below 50 %; pairs are still compared on common returns"
            .into(),
    ];
    let runs = vec![drift, run("größe", 1.1), run("truth", 1.0)];
    let mut undecided = pair("truth", "größe", Basis::CrossValidated, &[10.0, 2.0, 0.5, 0.2]);
    undecided.verdict = Verdict::Undecided;
    undecided.reason = "undecided: the residuals differ by no more than may be chance".into();
    let mut mixed = pair("drift", "größe", Basis::CrossValidated, &[10.0, 2.0, 0.5, 0.2]);
    mixed.verdict = Verdict::Mixed { run: "größe".into(), decided_at_m: 10.0 };
    mixed.reason =
        "better on the whole, globally: decided at the 10 m scale, but worse in scans 12–40 at 30 m".into();
    for scale in &mut mixed.scales {
        scale.difference_m2 = scale.difference_m2.map(|difference| -difference);
        scale.interval_m2 = scale.interval_m2.map(|[low, high]| [-high, -low]);
    }
    let pairs = vec![mixed, pair("truth", "drift", Basis::CrossValidated, &[10.0, 2.0, 0.5, 0.2]), undecided];
    let mut report = report(runs, &["truth", "größe", "drift"], pairs);
    report.ties = vec![["truth".into(), "größe".into()]];
    report.warnings = vec!["3 of 600 scans have no pose in `drift`".into()];
    report
}

pub(crate) fn one_run() -> Report {
    report(vec![run("truth", 1.0)], &["truth"], Vec::new())
}

/// Two runs with maps that were given.
pub(crate) fn given_maps() -> Report {
    let given = |name, factor| {
        let mut run = run(name, factor);
        (run.coverage, run.coverage_revisit) = (None, None);
        withhold(&mut run, "the map was given");
        run
    };
    let pairs = vec![pair("a", "b", Basis::Near, &[5.0, 2.0, 0.5])];
    let mut report = report(vec![given("a", 1.0), given("b", 4.0)], &["a", "b"], pairs);
    report.inputs.runs.iter_mut().for_each(|run| run.segments.length_m = None);
    report
}

/// Each better than the next.
pub(crate) fn many_runs(count: usize) -> Report {
    let names: Vec<String> = (0..count).map(|k| format!("run {k}")).collect();
    let order: Vec<&str> = names.iter().map(String::as_str).collect();
    let mut pairs = Vec::new();
    for (k, a) in order.iter().enumerate() {
        pairs.extend(order.iter().skip(k + 1).map(|b| pair(a, b, Basis::CrossValidated, &[10.0])));
    }
    report(order.iter().map(|name| run(name, 1.0)).collect(), &order, pairs)
}

fn withhold(run: &mut RunReport, why: &str) {
    run.r_cv_m2 = ScaleScores::new([10.0, 2.0, 0.5, 0.2].map(|scale_m| (scale_m, None)));
    run.r_cv_interval_m2 = None;
    run.r_cv_withheld = Some(Withheld::from(why.to_owned()));
}

/// The scores of the sample data.
fn sample() -> Value {
    serde_json::from_str(include_str!("../../../data-samples/scores.json")).unwrap()
}

/// Puts fields in place of others.
#[expect(clippy::needless_pass_by_value, reason = "callers make the values in place")]
fn with(mut value: Value, fields: Value) -> Value {
    let fields = fields.as_object().unwrap().clone();
    value.as_object_mut().unwrap().extend(fields);
    value
}

fn run(name: &str, factor: f64) -> RunReport {
    let scores = json!({
        "name": name, "returns": 1_200_000, "frames": 597,
        "dmp_sum_m2": factor * 4_096_000.0, "dmp_mean_m2": factor * 3.4567,
        "r_cv_m2": { "10": factor * 2.25, "2": factor * 0.16, "0.5": factor * 0.01, "0.2": factor * 0.0025 },
        "r_cv_interval_m2": [factor * 2.0, factor * 2.5], "r_near_interval_m2": null,
        "r_near_m2": { "5": factor * 0.36, "2": factor * 0.04, "0.5": factor * 0.0004 },
        "miss_rate": 0.021, "blocked_rate": 0.1234, "coverage": 0.8125, "coverage_revisit": 0.345,
        "log_likelihood_raw": factor * -5_120_000_000.0,
        "surfels": 345_678, "tiles": 91, "thin_voxels": 12_345, "warnings": []
    });
    serde_json::from_value(with(sample()["runs"][0].clone(), scores)).unwrap()
}

/// `a` better than `b` at the largest scale.
fn pair(a: &str, b: &str, basis: Basis, scales_m: &[f64]) -> PairReport {
    let scale = |&scale_m: &f64| ScaleReport {
        scale_m,
        mean_a_m2: Some(0.1 * scale_m),
        mean_b_m2: Some(0.1254 * scale_m),
        difference_m2: Some(-0.0254 * scale_m),
        interval_m2: Some([-0.0307 * scale_m, -0.0201 * scale_m]),
        returns: 876_543,
    };
    PairReport {
        a: a.into(),
        b: b.into(),
        basis,
        scales: scales_m.iter().map(scale).collect(),
        llr_raw: 123_456.0,
        apart: None,
        verdict: Verdict::Better { run: a.into(), decided_at_m: Some(scales_m[0]) },
        reason: "better globally: decided at the 10 m scale (876543 common returns)".into(),
    }
}

#[expect(clippy::needless_pass_by_value, reason = "callers make the values in place")]
fn report(runs: Vec<RunReport>, order: &[&str], pairs: Vec<PairReport>) -> Report {
    let sample = sample();
    let config = json!({ "voxel_m": 1638.0 / 8192.0, "ego_cells": 0 });
    let given = sample["inputs"]["runs"][0].clone();
    let segments = with(given["segments"].clone(), json!({ "length_m": 12.0, "count": 29 }));
    let given = with(given, json!({ "segments": segments }));
    let inputs = json!({
        "log": "town.mcap", "scans": 600, "scans_used": 597, "returns": 1_234_567, "returns_used": 1_200_000,
        "dropped": { "too_near": 30_000, "too_far": 4567, "vehicle": 0 }, "runs": [given], "notes": [], "damage": []
    });
    let fields = json!({
        "dmp_version": "0.0.0", "config": with(sample["config"].clone(), config),
        "inputs": with(sample["inputs"].clone(), inputs), "runs": runs, "order": order, "ties": [],
        "pairs": pairs, "drift": null, "warnings": [],
        "sampling": with(sample["sampling"].clone(), json!({ "frames_scored": 597 })),
        "timing": { "plan_s": 0.5, "fuse_s": 1.25, "trails_s": 0.0, "cast_s": 61.25, "total_s": 63.0, "threads": 2 },
        "memory": {
            "budget_bytes": 2_u64 << 30, "peak_anon_bytes": 300 << 20, "scratch_bytes": 0, "disk_bytes": 0,
            "disk_bytes_estimated": 0, "tile_loads": 182, "tiles_in_reach": 160, "tile_visits": 182
        }
    });
    serde_json::from_value(with(sample, fields)).unwrap()
}
