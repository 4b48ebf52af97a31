//! Correct runs with noise: what is reported of them is wrong.

use std::path::Path;

use dmp::{Basis, Config, Run, evaluate, vet};
use dmp_log::{LogOptions, ScanLog, open_log, read_trajectory};
use dmp_sensor::Trajectory;
use dmp_sim::{Noise, SlamErrors};

use super::drives::drives;
use super::logs::DriveLog;
use super::rooms::room;

/// Runs on each world, and how often they have a pose.
const RUNS: u64 = 100;
const RATES_HZ: [i64; 5] = [5, 10, 20, 50, 200];
/// The largest noise, metres of a drive and degrees.
const MOST_M: f64 = 0.05;
const MOST_DEG: f64 = 0.2;
/// The truncation at which runs are compared with their fixes, metres.
const SCALE_M: f64 = 0.5;

/// One row for each of the worlds that are wanted, or for all: of its noisy runs, how many are excluded, doubtful, or get a
/// hint, and whether that helps.
pub(super) fn print(wanted: &[String], out: &Path, data: Option<&Path>) -> anyhow::Result<()> {
    let is_wanted = |name: &str| wanted.is_empty() || wanted.iter().any(|wanted| wanted == name);
    println!(
        "\nnoisy runs: up to {MOST_M} m and {MOST_DEG}°, poses at {RATES_HZ:?} Hz\n\n\
         | world | runs | excluded | doubtful | with a hint | worse by `--mend` |\n|---|---:|---:|---:|---:|---|"
    );
    for spec in drives().into_iter().filter(|spec| is_wanted(spec.name)) {
        let DriveLog { log, truth, .. } = DriveLog::open(&spec, out)?;
        row(spec.name, log.as_ref(), &truth, 1.0)?;
    }
    if is_wanted("room-1") {
        let (log, runs) = room(1, &out.join("rooms"))?;
        row("room-1", log.as_ref(), &runs[0].trajectory, 0.1)?;
    }
    if let Some(folder) = data.map(|data| data.join("nclt_revisit")).filter(|_| is_wanted("nclt_revisit")) {
        let log = open_log(&folder, &LogOptions::default())?;
        let truth = read_trajectory(&folder.join("poses_lidar_odometry.txt"))?.trajectory;
        row("nclt_revisit", log.as_ref(), &truth, 1.0)?;
    }
    Ok(())
}

fn row(world: &str, log: &dyn ScanLog, truth: &Trajectory, metre_m: f64) -> anyhow::Result<()> {
    let runs: Vec<Run> = (0..RUNS)
        .map(|seed| noisy(truth, seed, metre_m, log.summary().span_ns.is_some()))
        .collect::<anyhow::Result<_>>()?;
    let config = Config::default();
    let found = vet(log, &runs, &config, false, &())?.found;
    let hinted: Vec<usize> =
        (0..runs.len()).filter(|&k| !found[k].mends.is_empty() || found[k].instant.is_some()).collect();
    let mut worse = Vec::new();
    for &k in &hinted {
        let mended = vet(log, &runs[k..=k], &config, true, &())?.runs;
        let [before_m2, after_m2] = [&runs[k..=k], &mended].map(|run| {
            let report = evaluate(log, run, &config, ()).ok()?;
            report.score_of(&runs[k].name, Basis::CrossValidated, SCALE_M)
        });
        if before_m2.zip(after_m2).is_none_or(|(before_m2, after_m2)| after_m2 > before_m2) {
            worse.push(format!("{}: {before_m2:?}, {after_m2:?} m²", runs[k].name));
        }
    }
    let excluded = found.iter().filter(|found| !found.is_kept()).count();
    let doubtful = found.iter().filter(|found| found.is_doubtful(false)).count();
    println!(
        "| {world} | {RUNS} | {excluded} | {doubtful} | {} | {} |",
        hinted.len(),
        if worse.is_empty() { "none".to_owned() } else { worse.join("; ") }
    );
    Ok(())
}

/// The truth with noise of a size and at a rate of this number's own; both kinds of noise are spread evenly. Poses of scans
/// without stamps belong to them one by one: `has_rate` is false.
fn noisy(truth: &Trajectory, number: u64, metre_m: f64, has_rate: bool) -> anyhow::Result<Run> {
    let spread = |step: f64| (number as f64 * step).fract();
    // Steps of the sequence by Roberts that covers a square evenly.
    let (sigma_m, sigma_deg) = (MOST_M * metre_m * spread(0.754_877_666), MOST_DEG * spread(0.569_840_291));
    let rate_hz = RATES_HZ[number as usize % RATES_HZ.len()];
    let interval_ns = if has_rate { 1_000_000_000 / rate_hz } else { truth.usual_step_ns() };
    let (first, last) = match truth.stamps_ns() {
        Some([first, .., last]) => (*first, *last),
        _ => anyhow::bail!("the truth has no stamps"),
    };
    let at = |k: i64| {
        let stamp_ns = first + k * interval_ns;
        Some((stamp_ns, truth.world_from_body_at(stamp_ns, i64::MAX)?))
    };
    let at_rate = || (0..=(last - first) / interval_ns).filter_map(at).collect();
    let posed = if has_rate { Trajectory::stamped(at_rate())?.trajectory } else { truth.clone() };
    let noise = Noise { sigma_m, sigma_rad: sigma_deg.to_radians(), interval_ns };
    let errors = SlamErrors { noise: Some(noise), seed: number, ..SlamErrors::default() };
    let name = format!("{number}: {:.2} cm, {sigma_deg:.2}°, {rate_hz} Hz", 100.0 * sigma_m);
    Ok(Run::new(name, errors.apply(&posed)?))
}
