//! One drive under one setting: simulate, score, compare with the truth.

use std::collections::{BTreeMap, HashSet};
use std::path::Path;
use std::time::Instant;

use anyhow::Context as _;
use dmp::{Report, Run};
use dmp_log::{LogOptions, McapScanWriter, McapWriterOptions, open_log};
use dmp_sensor::Point3;
use dmp_sim::Recording;
use dmp_study::{ReferenceSurface, Study, StudyOptions, StudyTable, study};

use super::consistency::Inconsistency;
use super::drives::{DriveSpec, Half};
use super::estimates::{Estimate, estimates};
use super::interval::{difference, places};
use super::observe::{CV_M, Frame, NEAR_M, Observer, Sum, pairs};
use super::result::{DriveResult, PairResult, RunResult, Said};
use super::setting::Setting;

/// Of the true surface one point is kept in each cell of this edge, metres.
const REFERENCE_M: f64 = 0.1;

/// Simulates the drive, scores all its estimates under the setting, and measures what only the truth can tell.
pub(super) fn evaluate(spec: &DriveSpec, setting: &Setting, work: &Path) -> anyhow::Result<DriveResult> {
    let start = Instant::now();
    let town = spec.options.town()?;
    let recording = Recording::new(&town, &spec.options)?;
    let path = work.join(format!("{}.mcap", spec.name));
    write_log(&recording, &path)?;
    let log = open_log(&path, &LogOptions::default())?;
    let mut estimates = estimates(spec, &spec.truth(&recording)?)?;
    estimates.retain(|estimate| setting.wants(&estimate.name));
    let runs: Vec<Run> = estimates.iter().map(|e| Run::new(&e.name, e.trajectory.clone())).collect();

    let observer = Observer::new(log.frames().len(), runs.len(), setting.against_truth);
    let surface = if setting.against_truth { reference_surface(spec)? } else { Vec::new() };
    let hand_over: &ReferenceSurface<'_> = &|reference| Ok(reference.add_points(&surface)?);
    let options = StudyOptions {
        peers: setting.against_truth.then(StudyOptions::default).and_then(|options| options.peers),
        ..StudyOptions::default()
    };
    let study = study(
        log.as_ref(),
        &runs,
        // Odometries stamp their poses within the sweep: the truth has a pose at all these stamps.
        &recording.drive().trajectory(100.0)?,
        setting.against_truth.then_some(hand_over),
        &setting.config(),
        &options,
        &observer,
    )
    .with_context(|| format!("{} under {}", spec.name, setting.name))?;
    let report = &study.score;
    let (frames, sightings) = observer.finish();
    let segments = &report.config.segments;
    let segment_of = |frame: usize| segments.starts_scan.partition_point(|&start| start <= frame) as i64 - 1;
    let any = sightings.as_ref().map(|s| s.inconsistency(&CV_M, |_, _| true));
    let apart = sightings.map(|s| s.inconsistency(&CV_M, |a, b| (segment_of(a) - segment_of(b)).abs() > 1));
    let squares = |of: &Option<Inconsistency>, run: usize| {
        of.as_ref().map_or_else(Vec::new, |of| of.squares_m2[run].clone())
    };
    let distance = |of: &Option<Inconsistency>, run: usize| of.as_ref().map(|of| of.distances_m[run]);

    let run_results = estimates.iter().enumerate().map(|(index, estimate)| RunResult {
        name: estimate.name.clone(),
        kind: format!("{:?}", estimate.kind),
        truth: truths(&study.table, index),
        inconsistency_m2: squares(&any, index),
        inconsistency_apart_m2: squares(&apart, index),
        inconsistency_m: distance(&any, index),
        inconsistency_apart_m: distance(&apart, index),
        scores: scores(&study, index, &frames),
        shares: shares(report, index),
    });
    Ok(DriveResult {
        drive: spec.name.to_owned(),
        held_out: spec.half == Half::HeldOut,
        setting: setting.name.to_owned(),
        voxel_m: report.config.voxel_m,
        segment_m: segments.length_m,
        segments: segments.count,
        travel_m: segments.travel_m,
        frames: frames.len(),
        returns: report.inputs.returns_used,
        runs: run_results.collect(),
        pairs: pair_results(report, &estimates, &frames),
        sightings: [any, apart].map(|of| of.map_or(0, |of| of.pairs)),
        seconds: start.elapsed().as_secs_f64(),
    })
}

/// Writes the drive's scans, unless they lie there already.
fn write_log(recording: &Recording<'_>, path: &Path) -> anyhow::Result<()> {
    if !path.exists() {
        let mut log = McapScanWriter::create(path, &McapWriterOptions::default())?;
        for scan in recording.scans() {
            log.write_scan(&scan)?;
        }
        log.finish()?;
    }
    Ok(())
}

/// Points on the true surfaces that the drive could see: its scans without noise and without traffic, one
/// point in each cell of [`REFERENCE_M`].
fn reference_surface(spec: &DriveSpec) -> anyhow::Result<Vec<[f64; 3]>> {
    let mut options = spec.options.clone();
    options.traffic = 0;
    options.lidar.range_noise_m = 0.0;
    options.lidar.bearing_noise_rad = 0.0;
    options.lidar.drop_out = 0.0;
    let town = options.town()?;
    let recording = Recording::new(&town, &options)?;
    let mut seen = HashSet::new();
    let mut points = Vec::new();
    for scan in recording.scans() {
        let start_ns = scan.stamp_ns.context("a simulated scan has a stamp")?;
        for (point, offset_ns) in scan.points_in_sensor_m.iter().zip(&scan.time_offsets_ns) {
            let pose = recording.drive().world_from_body_at(start_ns + offset_ns);
            let point: [f64; 3] = (pose * Point3::from(point.map(f64::from))).into();
            if seen.insert(point.map(|c| (c / REFERENCE_M).floor() as i32)) {
                points.push(point);
            }
        }
    }
    Ok(points)
}

/// Errors against the truth, metres.
fn truths(table: &StudyTable, index: usize) -> BTreeMap<String, f64> {
    let named = [("ate_rmse_m", "ATE"), ("rpe_rmse_m", "RPE"), ("smd_mean_m", "SMD")];
    let value = |key: &str| table.columns.iter().find(|c| c.key == key).and_then(|c| c.values[index]);
    named.iter().filter_map(|(key, name)| Some(((*name).to_owned(), value(key)?))).collect()
}

fn total(sums: impl Iterator<Item = Sum>) -> Sum {
    sums.fold(Sum::default(), |a, b| Sum { sum_m2: a.sum_m2 + b.sum_m2, returns: a.returns + b.returns })
}

/// Share of the full square that a missing prediction costs in R_cv.
pub(super) const KAPPAS: [f64; 5] = [0.0, 0.1, 0.25, 0.5, 1.0];

fn scores(study: &Study, index: usize, frames: &[Frame]) -> BTreeMap<String, Option<f64>> {
    let run = &study.score.runs[index];
    let mut scores = BTreeMap::from([
        ("DMP sum".to_owned(), Some(run.dmp_sum_m2)),
        ("DMP mean".to_owned(), run.dmp_mean_m2),
        ("miss".to_owned(), run.miss_rate),
        ("blocked".to_owned(), run.blocked_rate),
    ]);
    let of_run = || frames.iter().map(|frame| &frame.runs[index]);
    let returns: f64 = of_run().map(|frame| frame.returns).sum();
    for (k, t) in CV_M.iter().enumerate() {
        let hits = total(of_run().map(|frame| frame.cv[k]));
        let mean = (hits.returns > 0.0).then(|| hits.sum_m2 / hits.returns);
        scores.insert(format!("R_cv({t}) hits"), mean);
        for kappa in KAPPAS {
            let missing = returns - hits.returns;
            let all = (hits.sum_m2 + kappa * t * t * missing) / returns;
            scores.insert(format!("R_cv({t}) κ={kappa}"), Some(all));
        }
    }
    for (k, t) in NEAR_M.iter().enumerate() {
        let hits = total(of_run().map(|frame| frame.near[k]));
        scores.insert(format!("R_near({t})"), (hits.returns > 0.0).then(|| hits.sum_m2 / hits.returns));
    }
    for (key, name) in [("mme", "MME"), ("mpv_m2", "MPV"), ("mom_m2", "MOM")] {
        if let Some(column) = study.table.columns.iter().find(|column| column.key == key) {
            scores.insert(name.to_owned(), column.values[index]);
        }
    }
    scores
}

fn shares(report: &Report, index: usize) -> BTreeMap<String, Option<f64>> {
    let run = &report.runs[index];
    BTreeMap::from([
        ("coverage".to_owned(), run.coverage),
        ("revisit coverage".to_owned(), run.coverage_revisit),
        ("miss".to_owned(), run.miss_rate),
        ("blocked".to_owned(), run.blocked_rate),
    ])
}

fn pair_results(report: &Report, estimates: &[Estimate], frames: &[Frame]) -> Vec<PairResult> {
    let of_pair = |(index, (a, b)): (usize, (usize, usize))| {
        let said = report.pairs.iter().find(|p| p.a == estimates[a].name && p.b == estimates[b].name);
        let verdict = said.map_or(Said::Nothing, |pair| match pair.verdict.as_str() {
            "undecided" => Said::Nothing,
            "mixed" => Said::Mixed(pair.better_on_the_whole.as_ref() == Some(&pair.a)),
            name if name == pair.a => Said::A,
            _ => Said::B,
        });
        let mut singles = BTreeMap::new();
        let mut single = |name: String, frames: Vec<Sum>| {
            if let Some(value) = difference(&frames) {
                singles.insert(name, value);
            }
        };
        for (k, t) in CV_M.iter().enumerate() {
            single(format!("R_cv({t}) common"), frames.iter().map(|f| f.pairs[index].cv[k]).collect());
        }
        for (k, t) in NEAR_M.iter().enumerate() {
            single(format!("R_near({t})"), frames.iter().map(|f| f.pairs[index].near[k]).collect());
        }
        single("DMP mean".to_owned(), frames.iter().map(|f| f.pairs[index].first).collect());
        // Over all returns, a missing prediction at a quarter of the full square.
        let all = |f: &Frame| {
            let value = |run: usize| {
                f.runs[run].cv[1].sum_m2 + 25.0 * (f.runs[run].returns - f.runs[run].cv[1].returns)
            };
            Sum { sum_m2: value(a) - value(b), returns: f.runs[a].returns }
        };
        single("R_cv(10) κ=0.25".to_owned(), frames.iter().map(all).collect());
        let at = |k: usize| {
            let sums: Vec<Sum> = frames.iter().map(|f| f.pairs[index].cv[k]).collect();
            places(&sums, frames.iter().map(|f| f.pairs[index].cv_level_m2[k]))
        };
        let common: f64 = frames.iter().map(|f| f.pairs[index].cv[0].returns).sum();
        PairResult {
            a,
            b,
            verdict,
            decided_at_m: said.and_then(|pair| pair.decided_at_m),
            common: common / report.inputs.returns_used.max(1) as f64,
            singles,
            places: BTreeMap::from([
                ("30".to_owned(), at(0)),
                ("10".to_owned(), at(1)),
                ("2".to_owned(), at(3)),
            ]),
        }
    };
    pairs(estimates.len()).enumerate().map(of_pair).collect()
}
