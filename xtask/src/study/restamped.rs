//! Runs of a real odometry with the stamps that it writes itself: their clock error detected and fixed, beside true stamps.

use std::path::Path;

use dmp::{Axis, Basis, Config, Found, Mend, Run, Verdict, evaluate, vet};
use dmp_log::{LogSummary, ScanLog};
use dmp_sensor::Trajectory;

use super::drives::{DriveSpec, drives};
use super::estimates::{ODOMETRY, ate_m, odometry};
use super::logs::DriveLog;

/// The truncation whose scores are shown, metres.
const SCALE_M: f64 = 0.2;

/// On every drive both runs of the odometry. They are kept with the stamps at which their poses hold; the odometry stamps
/// with the start of the scan.
pub(super) fn print(out: &Path) -> anyhow::Result<()> {
    println!(
        "\nruns of the odometry, stamped with the start of their scans\n\n\
         | drive | run | held later, true | estimated | fixed by | R_cv({SCALE_M}) as stamped, fixed, true, cm | ATE, m | \
         as stamped against true | fixed against true |\n|---|---|---|---|---|---|---|---|---|"
    );
    for spec in drives() {
        let DriveLog { log, fine, .. } = DriveLog::open(&spec, out)?;
        for config in ODOMETRY {
            row(&spec, config, log.as_ref(), &fine)?;
        }
    }
    Ok(())
}

fn row(spec: &DriveSpec, config: &str, log: &dyn ScanLog, truth: &Trajectory) -> anyhow::Result<()> {
    let right = odometry(spec, config, truth)?;
    // A deskewed scan holds at its last return, one taken as rigid in the middle.
    let [first_ns, last_ns] = log.summary().sweep_ns;
    let held_ns = if config == "coarse" { first_ns.midpoint(last_ns) } else { last_ns };
    let Some(stamped) = right.clone().later_by(first_ns - held_ns) else { anyhow::bail!("beyond all times") };
    let config_of_all = Config::default();
    let vetted = vet(log, &[Run::new("fixed", stamped.clone())], &config_of_all, true, &())?;
    let runs =
        [Run::new("stamped", stamped.clone()), vetted.runs[0].clone(), Run::new("true", right.clone())];
    let report = evaluate(log, &runs, &config_of_all, ())?;
    let scores = runs.each_ref().map(|run| {
        let square_m2 = report.score_of(&run.name, Basis::CrossValidated, SCALE_M);
        square_m2.map_or("–".to_owned(), |square_m2| format!("{:.2}", 100.0 * square_m2.sqrt()))
    });
    let mended = stamped.clone().later_by(shift_ns(&runs[1], log.summary()));
    let ates = [Some(stamped), mended, Some(right)].map(|run| match run.map(|run| ate_m(&run, truth)) {
        Some(Ok(metres)) => format!("{metres:.3}"),
        _ => "–".to_owned(),
    });
    let verdict = |other: &str| report.verdict_between(other, "true").map_or("–".to_owned(), words);
    println!(
        "| {} | {config} | {:.1} ms | {} | {} | {} | {} | {} | {} |",
        spec.name,
        (held_ns - first_ns) as f64 / 1e6,
        time(&vetted.found[0]),
        mends(&vetted.found[0].mends),
        scores.join(", "),
        ates.join(", "),
        verdict("stamped"),
        verdict("fixed")
    );
    Ok(())
}

fn time(found: &Found) -> String {
    found.calibration.as_ref().map_or("–".to_owned(), |calibration| {
        let one = calibration.of(Axis::Time);
        let number = format!("{:.1} ± {:.1} ms", -1e3 * one.value, 1e3 * one.half);
        if one.is_seen { number } else { format!("not observable ({number})") }
    })
}

fn mends(mends: &[Mend]) -> String {
    let option = |mend: &Mend| mend.message_with("a", &|setting| format!("--{setting}"));
    if mends.is_empty() {
        "nothing".to_owned()
    } else {
        mends.iter().map(option).collect::<Vec<_>>().join(" ")
    }
}

/// How much later than its stamps a run's poses are taken to hold.
fn shift_ns(run: &Run, log: &LogSummary) -> i64 {
    run.instant().after_stamp_ns(log) - run.time_offset_ns.unwrap_or(0)
}

fn words(verdict: &Verdict) -> String {
    match verdict {
        Verdict::Better { run, decided_at_m, .. } => format!("{run} better at {decided_at_m} m"),
        Verdict::Mixed { run, decided_at_m, .. } => format!("mixed, {run} ahead at {decided_at_m} m"),
        Verdict::Same => "same".to_owned(),
        Verdict::Undecided => "undecided".to_owned(),
    }
}
