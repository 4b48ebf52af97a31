//! One drive under one setting: simulate, score, compare with the truth.

use std::collections::{BTreeMap, HashSet};
use std::path::Path;
use std::time::Instant;

use anyhow::{Context as _, ensure};
use dmp::{Confidence, Config, DriftReport, Report, Run, Verdict, measure_drift};
use dmp_log::{LogOptions, open_log};
use dmp_sensor::Point3;
use dmp_sim::Recording;
use dmp_study::{ReferenceSurface, Study, StudyOptions, StudyTable, study};

use super::consistency::{Inconsistency, Sightings, Weigh};
use super::drives::{DriveSpec, Half};
use super::estimates::{Estimate, estimates};
use super::interval::{BATCHES, difference, parts};
use super::logs::{log_and_runs, write_log};
use super::observe::{Both, CV_M, Frame, NEAR_M, Observer, PairFrame, Score, Sum, pairs};
use super::removal::frames_without_own;
use super::result::{DriveResult, PairResult, RunResult, Said, common_cv};
use super::rule::Rule;
use super::setting::Setting;

/// Of the true surface one point is kept in each cell of this edge, metres.
const REFERENCE_M: f64 = 0.1;

/// Simulates the drive, scores all its estimates under the setting, and measures what only the truth can tell.
pub(super) fn evaluate(spec: &DriveSpec, setting: &Setting, work: &Path) -> anyhow::Result<DriveResult> {
    let start = Instant::now();
    let town = spec.town()?;
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
        dmp::Watch::sink(&observer),
    )
    .with_context(|| format!("{} under {}", spec.name, setting.name))?;
    let report = &study.score;
    let (mut frames, mut surfaces, sightings) = observer.finish();
    let segments = &report.config.segments;
    if setting.fuse_without_own {
        // All estimates begin in one world; in one frame a group of surface is the same place in every map.
        let frame = dmp::Frame::of_report(report.inputs.runs[0].world_from_own);
        let config = Config { frame, voxel_m: Some(report.config.voxel_m), ..setting.config() };
        (frames, surfaces) = frames_without_own(log.as_ref(), &runs, &segments.starts_scan, &config)?;
    }
    let segment_of = |frame: usize| segments.starts_scan.partition_point(|&start| start <= frame) as i64 - 1;
    let (spreads, sightings) = sightings
        .map_or_else(Default::default, |s| spreads(&s, |a, b| (segment_of(a) - segment_of(b)).abs() > 1));

    let run_results = estimates.iter().enumerate().map(|(index, estimate)| RunResult {
        name: estimate.name.clone(),
        kind: format!("{:?}", estimate.kind),
        truth: truths(&study.table, index),
        inconsistency: spreads.iter().map(|(name, runs)| (name.clone(), runs[index].clone())).collect(),
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
        interval_confidence: report.promise.interval_confidence,
        runs: run_results.collect(),
        pairs: pair_results(setting, report, &estimates, &frames, &surfaces)?,
        sightings,
        seconds: start.elapsed().as_secs_f64(),
    })
}

/// Inconsistency of every run by each definition: of any two frames or of independent segments, every pair
/// of sightings alike or by the returns of its place.
fn spreads(
    sightings: &Sightings,
    apart: impl Fn(usize, usize) -> bool,
) -> (BTreeMap<String, Vec<Inconsistency>>, BTreeMap<String, u64>) {
    let (mut spreads, mut counts) = (BTreeMap::new(), BTreeMap::new());
    for (weigh, by) in [(Weigh::Pairs, "pairs"), (Weigh::Returns, "returns")] {
        for any in [true, false] {
            let (runs, count) = sightings.inconsistency(&CV_M, weigh, |a, b| any || apart(a, b));
            let name = format!("{}, by {by}", if any { "any" } else { "apart" });
            spreads.insert(name.clone(), runs);
            counts.insert(name, count);
        }
    }
    (spreads, counts)
}

/// Points on the true surfaces that the drive could see: its scans without noise and without traffic, one
/// point in each cell of [`REFERENCE_M`].
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
pub(super) const KAPPAS: [f64; 7] = [0.0, 0.1, 0.15, 0.2, 0.25, 0.5, 1.0];

fn scores(study: &Study, index: usize, frames: &[Frame]) -> BTreeMap<String, Option<f64>> {
    let run = &study.score.runs[index];
    let mut scores = BTreeMap::from([
        ("DMP sum".to_owned(), Some(run.dmp_sum_m2)),
        ("DMP mean".to_owned(), run.dmp_mean_m2),
        ("miss".to_owned(), run.miss_rate),
        ("blocked".to_owned(), run.blocked_rate),
        ("R_cv(10) as shown".to_owned(), run.r_cv_m2[0]),
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

/// Measures drift anew for a result that is there, as the command does beside its scores.
pub(super) fn measure_drift_anew(
    spec: &DriveSpec,
    setting: &Setting,
    work: &Path,
    result: &mut DriveResult,
) -> anyhow::Result<()> {
    let (path, mut runs) = log_and_runs(spec, work)?;
    runs.retain(|run| setting.wants(&run.name));
    ensure!(
        runs.iter().map(|run| &run.name).eq(result.runs.iter().map(|run| &run.name)),
        "{}: the result is of other estimates",
        spec.name
    );
    let log = open_log(&path, &LogOptions::default())?;
    let drift = measure_drift(log.as_ref(), &runs, &setting.config(), ())?;
    for pair in &mut result.pairs {
        pair.drift = drift_said(Some(&drift), &runs[pair.a].name, &runs[pair.b].name);
    }
    Ok(())
}

/// Which of two runs comes back better.
fn drift_said(drift: Option<&DriftReport>, name_a: &str, name_b: &str) -> Said {
    let compared = drift.into_iter().flat_map(|drift| &drift.comparisons);
    let mut of_both = compared.filter(|pair| pair.a == name_a && pair.b == name_b);
    match of_both.next().and_then(|pair| pair.better.as_deref()) {
        Some(better) if better == name_a => Said::A,
        Some(_) => Said::B,
        None => Said::Nothing,
    }
}

fn pair_results(
    setting: &Setting,
    report: &Report,
    estimates: &[Estimate],
    frames: &[Frame],
    surfaces: &[Vec<PairFrame>],
) -> anyhow::Result<Vec<PairResult>> {
    let confidence =
        Confidence::new(report.promise.interval_confidence).context("a confidence from 0.5 to below 1")?;
    let of_pair = |(index, (a, b)): (usize, (usize, usize))| {
        let [name_a, name_b] = [a, b].map(|run| &estimates[run].name);
        let pair = report.pair(name_a, name_b);
        let pair = pair.with_context(|| format!("{name_a} and {name_b} were not compared"))?;
        let verdict = match &pair.verdict {
            // The command's verdict is about other sums.
            _ if setting.fuse_without_own => Said::Nothing,
            Verdict::Undecided | Verdict::Same => Said::Nothing,
            Verdict::Mixed { run, .. } => Said::Mixed(run == name_a),
            Verdict::Better { run, .. } if run == name_a => Said::A,
            Verdict::Better { .. } => Said::B,
        };
        let (mut singles, mut batches) = (BTreeMap::new(), BTreeMap::new());
        let mut single = |name: String, score: Score| {
            let frames: Vec<Both> = frames.iter().map(|frame| frame.pairs[index].of(score)).collect();
            let groups: Vec<Both> = surfaces[index].iter().map(|group| group.of(score)).collect();
            if let Some(value) = difference(&frames, &groups) {
                batches.insert(name.clone(), parts(&frames, BATCHES));
                singles.insert(name, value);
            }
        };
        for (k, t) in CV_M.iter().enumerate() {
            single(common_cv(*t), Score::Cv(k));
        }
        for (k, t) in NEAR_M.iter().enumerate() {
            single(format!("R_near({t})"), Score::Near(k));
        }
        single("DMP mean".to_owned(), Score::First);
        let of_run = |run: usize| frames.iter().map(|frame| frame.runs[run].cv[0].returns).sum();
        let result = PairResult {
            a,
            b,
            verdict,
            decided_at_m: pair.verdict.decided_at_m(),
            is_same: pair.verdict.is_same(),
            drift: drift_said(report.drift.as_ref(), name_a, name_b),
            predicted: [of_run(a), of_run(b)],
            singles,
            batches,
        };
        let again = Rule::documented().say(&result, confidence);
        ensure!(
            setting.fuse_without_own || again.said == verdict,
            "{name_a} and {name_b}: the command says {verdict:?}, its rule on the study's own sums {again:?}"
        );
        Ok(result)
    };
    pairs(estimates.len()).enumerate().map(of_pair).collect()
}
