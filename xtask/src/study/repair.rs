//! `cargo xtask study repair`: trajectory errors of runs before and after repair.

use std::time::Instant;

use anyhow::Context as _;
use dmp::{Config, DriftPairs, Run, measure_drift};
use dmp_log::ScanLog;
use dmp_loops::{Outcome, Repair, RepairOptions, mend_by, repair};
use dmp_sensor::{PoseEdge, PoseGraph, Trajectory};

use super::chosen::Chosen;
use super::drives::DriveSpec;
use super::estimates::{Estimate, EstimateKind, ate_m, estimates};
use super::logs::DriveLog;

/// Repair the estimates of the drives: trajectory error before and after
#[derive(Debug, clap::Args)]
pub(super) struct RepairArgs {
    #[command(flatten)]
    chosen: Chosen,
    /// Also print every round
    #[arg(long)]
    each: bool,
}

/// The wanted improvement of drifted runs, as a factor in the median.
const WANTED: f64 = 5.0;
/// Standard deviations of true constraints, metres and radians.
const TRUE_M: f64 = 0.002;
const TRUE_RAD: f64 = 0.0001;
/// The largest allowed rise of an error, metres.
const WORST_M: f64 = 0.01;

pub(super) fn run(arguments: &RepairArgs) -> anyhow::Result<()> {
    let mut rows = Vec::new();
    for spec in &arguments.chosen.drives()? {
        println!("\n{} ({})\n{}", spec.name, spec.about, Row::HEAD);
        let of_drive = drive(spec, arguments).with_context(|| spec.name.to_owned())?;
        print(&of_drive);
        rows.extend(of_drive);
    }
    println!("\nAll together");
    print(&rows);
    Ok(())
}

/// An estimate of a drive, before and after.
struct Row {
    drive: &'static str,
    name: String,
    kind: EstimateKind,
    before_m: f64,
    after_m: f64,
    /// Repaired with true constraints at the revisits, metres.
    bound_m: f64,
    repair: Repair,
    seconds: f64,
}

impl Row {
    const HEAD: &str = "estimate           ATE [m]  repaired  by truth   factor  rounds  pairs  constraints  agree  accepted  steps err  R_near [m]  repaired      s";

    fn factor(&self) -> f64 {
        self.before_m / self.after_m
    }

    /// Whether it drifts like an odometry.
    fn is_drifted(&self) -> bool {
        use EstimateKind::{Bend, Drift, Mixed, Odometry};
        matches!(self.kind, Drift | Bend | Mixed | Odometry)
    }
}

impl std::fmt::Display for Row {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let rounds = &self.repair.rounds;
        let taken = rounds.iter().rev().find(|round| round.accepted > 0).or(rounds.last());
        let count = |of: fn(&dmp_loops::Round) -> usize| taken.map_or(0, of);
        let root = |m2: Option<f64>| m2.map_or(f64::NAN, f64::sqrt);
        write!(
            f,
            "{:<18} {:>7.3}  {:>8.3}  {:>8.3}  {:>7.1}  {:>6}  {:>5}  {:>11}  {:>5}  {:>8}  {:>9.2}  {:>10.4}  {:>8.4}  {:>5.0}  {}",
            self.name,
            self.before_m,
            self.after_m,
            self.bound_m,
            self.factor(),
            rounds.len(),
            count(|round| round.pairs_measured),
            count(|round| round.constraints),
            count(|round| round.consistent),
            count(|round| round.accepted),
            taken.map_or(f64::NAN, |round| round.step_error.place_m
                / RepairOptions::default().step_error.place_m),
            root(self.repair.r_near_before_m2),
            root(taken.and_then(|round| round.r_near_m2)),
            self.seconds,
            if self.repair.outcome == Outcome::Repaired {
                String::new()
            } else {
                format!("{:?}", self.repair.outcome)
            },
        )
    }
}

fn drive(spec: &DriveSpec, arguments: &RepairArgs) -> anyhow::Result<Vec<Row>> {
    let DriveLog { log, truth, fine } = DriveLog::open(spec, &arguments.chosen.out)?;
    let estimates = estimates(spec, &truth)?;
    let known = true_constraints(log.as_ref(), &fine)?;
    let mut rows = Vec::new();
    for estimate in estimates.into_iter().filter(|one| arguments.chosen.wants(one)) {
        let row = row(spec, log.as_ref(), estimate, (&fine, &known))?;
        println!("{row}");
        if arguments.each {
            row.repair.rounds.iter().for_each(|round| println!("    {round:?}"));
        }
        rows.push(row);
    }
    Ok(rows)
}

fn row(
    spec: &DriveSpec,
    log: &dyn ScanLog,
    estimate: Estimate,
    (truth, known): (&Trajectory, &[PoseEdge]),
) -> anyhow::Result<Row> {
    let start = Instant::now();
    let before_m = ate_m(&estimate.trajectory, truth)?;
    let run = Run::new(&estimate.name, estimate.trajectory);
    let options = RepairOptions::default();
    let repair = repair(log, &run, &Config::default(), &options, &())?;
    let after_m = repair.trajectory.as_ref().map_or(Ok(before_m), |repaired| ate_m(repaired, truth))?;
    let seconds = start.elapsed().as_secs_f64();
    let bound = mend_by(log, &run, &Config::default(), known, &options, &())?;
    let bound_m = bound.map_or(Ok(before_m), |mended| ate_m(&mended, truth))?;
    Ok(Row {
        drive: spec.name,
        name: estimate.name,
        kind: estimate.kind,
        before_m,
        after_m,
        bound_m,
        repair,
        seconds,
    })
}

/// True constraints between the visits to the same places, better than any measured ones.
fn true_constraints(log: &dyn ScanLog, truth: &Trajectory) -> anyhow::Result<Vec<PoseEdge>> {
    let run = [Run::new("truth", truth.clone())];
    let report = measure_drift(log, &run, &Config { drift: DriftPairs::All, ..Config::default() }, ())?;
    let pose = |scan: usize| truth.world_from_body_at(log.frames().get(scan)?.stamp_ns?, i64::MAX);
    let edge = |visit: &dmp::VisitPairReport| {
        let (from, to) = (visit.first.scan, visit.second.scan);
        Some(PoseEdge {
            from: from as i64,
            to: to as i64,
            from_from_to: pose(from)?.inv_mul(&pose(to)?),
            information: PoseGraph::information_of(TRUE_M, TRUE_RAD),
        })
    };
    Ok(report.runs.iter().flat_map(|run| &run.visits).filter_map(edge).collect())
}

fn print(rows: &[Row]) {
    let mut factors: Vec<f64> = rows.iter().filter(|row| row.is_drifted()).map(Row::factor).collect();
    factors.sort_by(f64::total_cmp);
    if let Some(median) = factors.get(factors.len() / 2) {
        let enough = factors.iter().filter(|factor| **factor >= WANTED).count();
        println!(
            "drifted estimates: {}, of these {enough} at least {WANTED} times better; median {median:.1}",
            factors.len()
        );
        let mut bounds: Vec<f64> =
            rows.iter().filter(|row| row.is_drifted()).map(|row| row.before_m / row.bound_m).collect();
        bounds.sort_by(f64::total_cmp);
        println!(
            "repaired with true constraints at the revisits: median {:.1}",
            bounds.get(bounds.len() / 2).copied().unwrap_or(f64::NAN)
        );
    }
    let rise = |row: &Row| row.after_m - row.before_m;
    if let Some(worst) = rows.iter().max_by(|a, b| rise(a).total_cmp(&rise(b))) {
        let over = rows.iter().filter(|row| rise(row) > WORST_M).count();
        println!(
            "worst rise: {:.3} m ({} of {}); {over} of {} rise by more than {WORST_M} m",
            rise(worst),
            worst.name,
            worst.drive,
            rows.len()
        );
    }
}
