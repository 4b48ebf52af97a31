//! One drive: simulate, score, compare with the truth.

use std::collections::{BTreeMap, HashSet};
use std::path::Path;
use std::time::Instant;

use anyhow::{Context as _, ensure};
use dmp::{Confidence, Config, DriftPairs, Report, Run, Verdict, Watch};
use dmp_log::FrameInfo;
use dmp_sensor::{Point3, Trajectory};
use dmp_sim::Recording;

use super::drives::{DriveSpec, Half};
use super::estimates::{Estimate, estimates};
use super::interval::{batch_count, difference, parts};
use super::logs::DriveLog;
use super::observe::{Frame, NEAR_M, Observed, Observer, Sum, pair_scores, pairs};
use super::result::{Both, DriveResult, PairResult, RunResult, Said};
use super::rule::documented;
use super::truth::TrueErrors;

/// Of the true surface one point is kept in each cell of this edge, metres.
const REFERENCE_M: f64 = 0.1;
/// Share of the full square that a missing prediction costs in `R_cv` (docs/metric.md).
const KAPPA: f64 = 0.15;

/// Simulates the drive, scores all its estimates on every so many scans, and measures their true errors.
pub(super) fn evaluate(spec: &DriveSpec, work: &Path, every: usize) -> anyhow::Result<DriveResult> {
    let start = Instant::now();
    let drive = DriveLog::open(spec, work)?.with_every(every)?;
    let estimates = estimates(spec, &drive.truth)?;
    let runs: Vec<Run> = estimates.iter().map(|e| Run::new(&e.name, e.trajectory.clone())).collect();
    let observer = Observer::new(drive.log.frames().len(), runs.len());
    let config = Config { drift: DriftPairs::All, ..Config::default() };
    let report = dmp::evaluate(drive.log.as_ref(), &runs, &config, Watch::sink(&observer))
        .with_context(|| spec.name.to_owned())?;
    let observed = observer.finish();

    let starts = &report.inputs.runs[0].segments.starts_scan;
    let segment_of = |frame: usize| starts.partition_point(|&start| start <= frame) as i64 - 1;
    let any = observed.sightings.inconsistency_m(|_, _| true);
    let apart = observed.sightings.inconsistency_m(|a, b| (segment_of(a) - segment_of(b)).abs() > 1);
    let surface = reference_surface(spec)?;
    let run = |(index, estimate): (usize, &Estimate)| {
        let errors = TrueErrors::of(&estimate.trajectory, &drive.fine)?;
        let smd_m = errors.surface_distance_m(&observed.clouds[index], &surface)?;
        let truth = [("ATE", Some(errors.ate_m)), ("RPE", errors.rpe_m), ("SMD", Some(smd_m))];
        let of_report = &report.runs[index];
        Ok(RunResult {
            name: estimate.name.clone(),
            kind: format!("{:?}", estimate.kind),
            truth: truth.into_iter().filter_map(|(name, m)| Some((name.to_owned(), m?))).collect(),
            inconsistency_m: [&any, &apart].map(|runs| runs.as_ref().map(|runs| runs[index])),
            scores: scores(&report, index, &observed.frames),
            coverage: of_report.coverage,
            coverage_revisit: of_report.coverage_revisit,
        })
    };
    Ok(DriveResult {
        drive: spec.name.to_owned(),
        held_out: spec.half == Half::HeldOut,
        runs: estimates.iter().enumerate().map(run).collect::<anyhow::Result<_>>()?,
        pairs: pair_results(&report, &estimates, &observed, drive.log.frames())?,
        seconds: start.elapsed().as_secs_f64(),
    })
}

/// Points on the true surfaces that the drive could see: its scans without noise and traffic, one point in each cell of
/// [`REFERENCE_M`].
fn reference_surface(spec: &DriveSpec) -> anyhow::Result<Vec<[f64; 3]>> {
    let mut options = spec.options.clone();
    options.traffic = 0;
    options.lidar.range_noise_m = 0.0;
    options.lidar.bearing_noise_rad = 0.0;
    options.lidar.drop_out = 0.0;
    let town = options.town_of(spec.scenery)?;
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

/// Every score of a run by its name in the tables.
fn scores(report: &Report, index: usize, frames: &[Frame]) -> BTreeMap<String, Option<f64>> {
    let run = &report.runs[index];
    let sum = |score: usize| {
        frames.iter().fold(Sum::default(), |total, frame| {
            let of_frame = frame.runs[index][score];
            Sum { sum_m2: total.sum_m2 + of_frame.sum_m2, returns: total.returns + of_frame.returns }
        })
    };
    let mut scores = BTreeMap::from([
        ("DMP sum".to_owned(), Some(run.dmp_sum_m2)),
        ("DMP mean".to_owned(), run.dmp_mean_m2),
        ("miss rate".to_owned(), run.miss_rate),
        ("blocked".to_owned(), run.blocked_rate),
        ("thickness".to_owned(), run.map.thickness.as_ref().map(|thickness| thickness.median_m)),
        ("thickness, 95 %".to_owned(), run.map.thickness.as_ref().map(|thickness| thickness.p95_m)),
        ("R_cv(10), where it is shown".to_owned(), run.r_cv_m2[0]),
    ]);
    let returns: f64 = frames.iter().map(|frame| frame.returns).sum();
    for (k, (name, t)) in pair_scores().enumerate() {
        let hits = sum(k);
        let mean = (hits.returns > 0.0).then(|| hits.sum_m2 / hits.returns);
        let (name, value) = match name.strip_suffix(" common") {
            // Missing predictions are priced at the largest scale alone.
            Some(name) if t == 10.0 => {
                (name, Some((hits.sum_m2 + KAPPA * t * t * (returns - hits.returns)) / returns))
            }
            Some(name) if t < 10.0 => (name, mean),
            None if NEAR_M.contains(&t) => (name.as_str(), mean),
            _ => continue,
        };
        scores.insert(name.to_owned(), value);
    }
    scores
}

fn pair_results(
    report: &Report,
    estimates: &[Estimate],
    Observed { frames, surfaces, .. }: &Observed,
    log: &[FrameInfo],
) -> anyhow::Result<Vec<PairResult>> {
    let confidence =
        Confidence::new(report.promise.interval_confidence).context("a confidence from 0.5 to below 1")?;
    let back: Vec<f64> = estimates.iter().map(|one| share_back(log, &one.trajectory)).collect();
    let of_pair = |(index, (a, b)): (usize, (usize, usize))| {
        let [name_a, name_b] = [a, b].map(|run| &estimates[run].name);
        let pair = report.pair(name_a, name_b);
        let pair = pair.with_context(|| format!("{name_a} and {name_b} were not compared"))?;
        let verdict = match &pair.verdict {
            Verdict::Undecided | Verdict::Same => Said::Nothing,
            Verdict::Mixed { run, .. } => Said::Mixed(run == name_a),
            Verdict::Better { run, .. } if run == name_a => Said::A,
            Verdict::Better { .. } => Said::B,
        };
        let (mut singles, mut batches) = (BTreeMap::new(), BTreeMap::new());
        for (k, (name, _)) in pair_scores().enumerate() {
            let of_frames: Vec<Both> = frames.iter().map(|frame| frame.pairs[index][k]).collect();
            let of_groups: Vec<Both> = surfaces[index].iter().map(|group| group[k]).collect();
            if let Some(value) = difference(&of_frames, &of_groups) {
                batches.insert(name.clone(), parts(&of_frames, batch_count(of_frames.len())));
                singles.insert(name, value);
            }
        }
        let predicted = [a, b].map(|run| frames.iter().map(|frame| frame.runs[run][0].returns).sum());
        let revisited = [name_a, name_b].map(|name| report.run(name).and_then(|run| run.coverage_revisit));
        let revisited = revisited.map(Option::unwrap_or_default);
        let back = [a, b].map(|run| back[run]);
        let (decided_at_m, drift) = (pair.verdict.decided_at_m(), drift_said(report, name_a, name_b));
        let result =
            PairResult { a, b, verdict, decided_at_m, drift, predicted, revisited, back, singles, batches };
        let by_scores = if pair.verdict.is_by_drift() { Said::Nothing } else { verdict };
        let again = documented(&result, confidence);
        ensure!(
            again == by_scores || pair.verdict == Verdict::Same,
            "{name_a} and {name_b}: the command says {by_scores:?}, its rule on the study's own sums {again:?}"
        );
        Ok(result)
    };
    pairs(estimates.len()).enumerate().map(of_pair).collect()
}

/// The share of the scans, half a metre of travel apart, with an earlier one up to 20 m away and 66 m of travel before.
fn share_back(frames: &[FrameInfo], run: &Trajectory) -> f64 {
    let pose = |frame: &FrameInfo| run.world_from_body_at(frame.stamp_ns?, 1_000_000_000);
    let places: Vec<_> = frames.iter().filter_map(pose).map(|pose| pose.translation.vector).collect();
    let along_m = dmp_sensor::along_m(&places.iter().copied().map(Some).collect::<Vec<_>>(), 1.0);
    let mut keys: Vec<usize> = Vec::new();
    for k in 0..places.len() {
        if keys.last().is_none_or(|&last| along_m[k] - along_m[last] >= 0.5) {
            keys.push(k);
        }
    }
    let is_back = |&&later: &&usize| {
        let mut before = keys.iter().take_while(|&&k| along_m[later] - along_m[k] >= 66.0);
        before.any(|&k| (places[later] - places[k]).norm() <= 20.0)
    };
    keys.iter().filter(is_back).count() as f64 / keys.len().max(1) as f64
}

/// Which of two runs drifts less.
fn drift_said(report: &Report, name_a: &str, name_b: &str) -> Said {
    let compared = report.drift.iter().flat_map(|drift| &drift.comparisons);
    let mut of_both = compared.filter(|pair| pair.a == name_a && pair.b == name_b);
    match of_both.next().and_then(|pair| pair.better.as_deref()) {
        Some(better) if better == name_a => Said::A,
        Some(_) => Said::B,
        None => Said::Nothing,
    }
}
