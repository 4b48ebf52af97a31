//! `cargo xtask study drift`: drift measured at revisits, beside the truth.

use anyhow::Context as _;
use dmp::{Config, DriftPairs, DriftReach, Run, RunDrift, VisitReport, measure_drift};
use dmp_log::ScanLog;
use dmp_sensor::{Isometry3, Matrix3, Trajectory, Vector3};
use dmp_truth::rank::spearman_rho;

use super::chosen::Chosen;
use super::drives::DriveSpec;
use super::estimates::{Estimate, EstimateKind, ate_m, estimates};
use super::logs::DriveLog;
use super::rooms::room;

/// Measure the drift of all estimates at revisits and compare with the truth
#[derive(Debug, clap::Args)]
pub(super) struct DriftArgs {
    #[command(flatten)]
    chosen: Chosen,
    /// Search visits and starts further off, as `dmp drift --far` does
    #[arg(long)]
    far: bool,
    /// Also print every pair
    #[arg(long)]
    each: bool,
}

/// Rooms, by their seeds.
const ROOMS: std::ops::RangeInclusive<u64> = 1..=8;
/// What a metre of a drive is in a room, metres.
const ROOM_METRE_M: f64 = 0.1;
/// Right runs that are read wrongly: clock, and pitch of the mounting.
const LATE_NS: i64 = 100_000_000;
const TILTED_DEG: f64 = 2.0;

/// A pair is wrong that is off by more than this, metres of a drive, and by more than this share of what is true.
const WRONG_M: f64 = 0.1;
const WRONG_SHARE: f64 = 0.1;
/// What is known no better than this of a direction is not known, metres of a drive.
const KNOWN_M: f64 = 0.1;
/// Runs that are truly off by less than this are not used for the bias, metres.
const LEAST_M: f64 = 0.02;

pub(super) fn run(arguments: &DriftArgs) -> anyhow::Result<()> {
    let mut rows = Vec::new();
    for spec in &arguments.chosen.drives()? {
        println!("\n{} ({})", spec.name, spec.about);
        println!("{}", Row::HEAD);
        let of_drive = drive(spec, arguments).with_context(|| spec.name.to_owned())?;
        let of = |value: fn(&Row) -> Option<f64>| of_drive.iter().map(value).collect::<Vec<_>>();
        let (measured, truth) = (of(|row| row.rms_m), of(|row| row.true_rms_m));
        if let Some(rho) = spearman_rho(&measured, &truth) {
            println!("rank correlation of measured and true RMS: {rho:.3}");
        }
        rows.extend(of_drive);
    }
    summary(&rows);
    if arguments.chosen.is_all() {
        let mut rows = Vec::new();
        println!("\nrooms\n{}", Row::HEAD);
        for seed in ROOMS {
            let (log, runs) = room(seed, &arguments.chosen.out.join("rooms"))?;
            let truth = runs[0].trajectory.clone();
            for run in &runs {
                let is_truth = run.name == "truth";
                let kind = if is_truth { EstimateKind::Truth } else { EstimateKind::Drift };
                let name = format!("{}-{seed}", run.name);
                let estimate = Estimate { name, kind, trajectory: run.trajectory.clone() };
                let judged = Judged { log: log.as_ref(), truth: &truth, metre_m: ROOM_METRE_M };
                rows.push(judged.row(estimate, arguments)?);
            }
        }
        summary(&rows);
    }
    Ok(())
}

/// An estimate of a drive.
struct Row {
    name: String,
    kind: EstimateKind,
    ate_m: f64,
    pairs: usize,
    /// Pairs that are lost.
    lost: usize,
    /// Of them those where the run is truly off by less than the bound says.
    beyond: usize,
    /// Of each answer in all directions, how far it is from what is true, metres; whether that is wrong; and its three
    /// components within 3σ.
    answers: Vec<Answer>,
    /// Answers in some directions alone, and how many of these are wrong there.
    in_part: [usize; 2],
    rms_m: Option<f64>,
    true_rms_m: Option<f64>,
}

#[derive(Clone, Copy)]
struct Answer {
    is_wrong: bool,
    within: usize,
    sigmas: [f64; 3],
    true_m: f64,
}

impl Row {
    const HEAD: &str = "estimate           ATE [m]  pairs   lost  answers  RMS measured  RMS true [m]  ratio  wrong  in 3 sigma     in part, wrong";
}

impl std::fmt::Display for Row {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let wrong = self.answers.iter().filter(|answer| answer.is_wrong).count();
        let within: usize = self.answers.iter().map(|answer| answer.within).sum();
        let [measured, truth] = [self.rms_m, self.true_rms_m].map(|m| m.unwrap_or(f64::NAN));
        write!(
            f,
            "{:<18} {:>7.3}  {:>5}  {:>5}  {:>7}  {measured:>12.4}  {truth:>12.4}  {:>5.2}  {wrong:>5}  {within:>4} of {:<4} {:>8}, {}",
            self.name,
            self.ate_m,
            self.pairs,
            self.lost,
            self.answers.len(),
            measured / truth,
            3 * self.answers.len(),
            self.in_part[0],
            self.in_part[1],
        )
    }
}

fn drive(spec: &DriveSpec, arguments: &DriftArgs) -> anyhow::Result<Vec<Row>> {
    let DriveLog { log, truth, fine } = DriveLog::open(spec, &arguments.chosen.out)?;
    let judged = Judged { log: log.as_ref(), truth: &fine, metre_m: 1.0 };
    let estimates = estimates(spec, &truth)?.into_iter().filter(|one| arguments.chosen.wants(one));
    let rows = estimates.map(|estimate| judged.row(estimate, arguments)).collect::<Result<_, _>>()?;
    let tilt = Isometry3::rotation(Vector3::y() * TILTED_DEG.to_radians());
    let tilted = truth.poses().iter().map(|pose| pose * tilt);
    let stamps_ns = truth.stamps_ns().context("the truth has stamps")?;
    let tilted = Trajectory::stamped(stamps_ns.iter().copied().zip(tilted).collect())?.trajectory;
    for (name, wrong) in [("late", truth.clone().later_by(LATE_NS)), ("tilted", Some(tilted))] {
        let run = Run::new(name, wrong.context("a clock overflows")?);
        let of_run = &judged.drift(&run, arguments)?;
        println!("the truth, {name}: {} pairs, {} lost", of_run.pairs_measured, of_run.pairs_lost);
    }
    Ok(rows)
}

/// Of the place that a motion leads to, given the upper triangle of the covariance of a rotation vector and a translation put
/// before it.
fn of_place(upper: &[f64; 21], place: &Vector3<f64>) -> Matrix3<f64> {
    let at = |row: usize, column: usize| {
        let (row, column) = (row.min(column), row.max(column));
        upper[row * 6 - row * (row + 1) / 2 + column]
    };
    let part = |row: usize, column: usize| Matrix3::from_fn(|k, l| at(row + k, column + l));
    let by_turn = -place.cross_matrix();
    by_turn * part(0, 0) * by_turn.transpose()
        + by_turn * part(0, 3)
        + part(3, 0) * by_turn.transpose()
        + part(3, 3)
}

/// The length of an error in the directions that are known, each to `known_m`.
fn known_part(covariance: &Matrix3<f64>, error: &Vector3<f64>, known_m: f64) -> f64 {
    let directions = covariance.symmetric_eigen();
    let known = (0..3).filter(|&k| directions.eigenvalues[k] <= known_m * known_m);
    known.map(|k| directions.eigenvectors.column(k).dot(error).powi(2)).sum::<f64>().sqrt()
}

/// Of a log whose truth is known.
struct Judged<'a> {
    log: &'a dyn ScanLog,
    truth: &'a Trajectory,
    /// What a metre of a drive is here, metres.
    metre_m: f64,
}

impl Judged<'_> {
    /// The drift of a run, alone: its numbers are the same in company.
    fn drift(&self, run: &Run, arguments: &DriftArgs) -> anyhow::Result<RunDrift> {
        let drift_reach = if arguments.far { DriftReach::Far } else { DriftReach::Near };
        let config = Config { drift: DriftPairs::All, drift_reach, ..Config::default() };
        let report = measure_drift(self.log, std::slice::from_ref(run), &config, ())?;
        report.runs.into_iter().next().context("no run")
    }

    fn row(&self, estimate: Estimate, arguments: &DriftArgs) -> anyhow::Result<Row> {
        let of_run = self.drift(&Run::new(&estimate.name, estimate.trajectory.clone()), arguments)?;
        let (mut answers, mut in_part, mut beyond) = (Vec::new(), [0, 0], 0);
        for visit in &of_run.visits {
            let of_visit = self.truth_of(&estimate.trajectory, &visit.first, &visit.second);
            let (Some(off), Some(seven), Some(covariance)) =
                (&visit.off, visit.first_from_second, visit.covariance)
            else {
                let true_m = of_visit.map_or(f64::NAN, |(_, off)| off.norm());
                beyond += usize::from(
                    visit.at_least_m.is_some_and(|at_least_m| true_m.is_nan() || at_least_m > true_m),
                );
                if arguments.each {
                    println!(
                        "    {} {}: true {true_m:.3}{}, {}",
                        visit.first.scan,
                        visit.second.scan,
                        visit.at_least_m.map_or(String::new(), |m| format!(", lost, at least {m:.3}")),
                        visit.why_not.as_deref().unwrap_or("")
                    );
                }
                continue;
            };
            let measured = Vector3::new(seven[0], seven[1], seven[2]);
            let Some((truth, off_truth)) = of_visit else { continue };
            let error = measured - truth;
            let covariance = of_place(&covariance, &measured);
            let true_m = off_truth.norm();
            let tolerance_m = (WRONG_M * self.metre_m).max(WRONG_SHARE * true_m);
            if off.distance_m.is_none() {
                let is_wrong = known_part(&covariance, &error, KNOWN_M * self.metre_m) > tolerance_m;
                in_part = [in_part[0] + 1, in_part[1] + usize::from(is_wrong)];
                continue;
            }
            let sigmas = [0, 1, 2].map(|k| covariance[(k, k)].sqrt());
            let within = (0..3).filter(|&k| error[k].abs() <= 3.0 * sigmas[k]).count();
            let is_wrong = error.norm() > tolerance_m;
            if arguments.each {
                println!(
                    "    {} {}: true {true_m:.3}, wrong by [{:.4} {:.4} {:.4}], sigma [{:.4} {:.4} {:.4}], overlap {:.2}, held {:.4}{}",
                    visit.first.scan,
                    visit.second.scan,
                    error.x,
                    error.y,
                    error.z,
                    sigmas[0],
                    sigmas[1],
                    sigmas[2],
                    off.overlap,
                    off.held,
                    if is_wrong { " WRONG" } else { "" },
                );
            }
            answers.push(Answer { is_wrong, within, sigmas, true_m });
        }
        let squares: f64 = answers.iter().map(|answer| answer.true_m * answer.true_m).sum();
        let row = Row {
            kind: estimate.kind,
            ate_m: ate_m(&estimate.trajectory, self.truth)?,
            name: estimate.name,
            pairs: of_run.visits.len(),
            lost: of_run.pairs_lost,
            beyond,
            rms_m: of_run.rms_m.value,
            in_part,
            true_rms_m: (!answers.is_empty()).then(|| (squares / answers.len() as f64).sqrt()),
            answers,
        };
        println!("{row}");
        Ok(row)
    }

    /// Where the second visit's surfaces are as seen from the first, and by how much the run puts it elsewhere, metres.
    ///
    /// A visit's surfaces are where its scans are on the mean, not its middle one alone.
    fn truth_of(
        &self,
        estimate: &Trajectory,
        first: &VisitReport,
        second: &VisitReport,
    ) -> Option<(Vector3<f64>, Vector3<f64>)> {
        let [true_first, true_second] = [first, second].map(|visit| self.pose(self.truth, visit.scan, 0));
        let [put_first, put_second] = [first, second].map(|visit| self.pose(estimate, visit.scan, 0));
        let first_from_second = self.mean_correction(estimate, first)?.inverse()
            * true_first?.inverse()
            * true_second?
            * self.mean_correction(estimate, second)?;
        let claimed = put_first?.inverse() * put_second?;
        let truth = first_from_second.translation.vector;
        Some((truth, claimed.translation.vector - truth))
    }

    /// What brings a visit's surfaces, as the run has them about its middle scan, to where they are about that.
    fn mean_correction(&self, estimate: &Trajectory, visit: &VisitReport) -> Option<Isometry3<f64>> {
        let middle_ns = self.log.summary().middle_ns;
        let [put, truth] = [estimate, self.truth].map(|run| self.pose(run, visit.scan, 0));
        let (put, truth) = (put?.inverse(), truth?.inverse());
        let (mut turn, mut shift, mut count) = (Vector3::zeros(), Vector3::zeros(), 0.0);
        for &scan in &visit.scans {
            let [Some(put_scan), Some(true_scan)] =
                [estimate, self.truth].map(|run| self.pose(run, scan, middle_ns))
            else {
                continue;
            };
            let correction = (truth * true_scan) * (put * put_scan).inverse();
            turn += correction.rotation.scaled_axis();
            shift += correction.translation.vector;
            count += 1.0;
        }
        (count > 0.0).then(|| Isometry3::new(shift / count, turn / count))
    }

    fn pose(&self, run: &Trajectory, scan: usize, after_ns: i64) -> Option<Isometry3<f64>> {
        let stamp_ns = self.log.frames().get(scan)?.stamp_ns?;
        run.world_from_body_at(stamp_ns + after_ns, i64::MAX)
            .or_else(|| run.world_from_body_at(stamp_ns, i64::MAX))
    }
}

fn summary(rows: &[Row]) {
    let answers: Vec<&Answer> = rows.iter().flat_map(|row| &row.answers).collect();
    let wrong = answers.iter().filter(|answer| answer.is_wrong).count();
    let within: usize = answers.iter().map(|answer| answer.within).sum();
    let pairs: usize = rows.iter().map(|row| row.pairs).sum();
    println!("\n{} runs, {pairs} pairs, {} answers", rows.len(), answers.len());
    println!("wrong: {wrong} ({:.2} %)", 100.0 * wrong as f64 / answers.len() as f64);
    let lost_of = |is_truth: bool| {
        let of = rows.iter().filter(|row| (row.kind == EstimateKind::Truth) == is_truth);
        of.map(|row| row.lost).sum::<usize>()
    };
    let beyond: usize = rows.iter().map(|row| row.beyond).sum();
    println!(
        "lost: {} pairs of estimates, {} of the truth; a bound above the truth: {beyond}",
        lost_of(false),
        lost_of(true)
    );
    println!("components within 3 sigma: {:.4}", within as f64 / (3 * answers.len()) as f64);
    let mut sigmas: Vec<f64> = answers.iter().flat_map(|answer| answer.sigmas).collect();
    sigmas.sort_by(f64::total_cmp);
    println!("median sigma: {:.4} m", sigmas.get(sigmas.len() / 2).copied().unwrap_or(f64::NAN));
    let biases = |is_noise: bool| {
        let of = rows.iter().filter(|row| {
            matches!(row.kind, EstimateKind::Noise | EstimateKind::Mixed) == is_noise
                && row.lost == 0
                && row.true_rms_m.is_some_and(|m| m >= LEAST_M)
        });
        of.filter_map(|row| Some((row.rms_m? / row.true_rms_m? - 1.0, &row.name))).collect::<Vec<_>>()
    };
    for (is_noise, what) in [(false, "without noise"), (true, "with noise")] {
        let mut biases = biases(is_noise);
        biases.sort_by(|a, b| a.0.abs().total_cmp(&b.0.abs()));
        if let (Some(median), Some(worst)) = (biases.get(biases.len() / 2), biases.last()) {
            println!(
                "bias of runs {what} that are off by {LEAST_M} m or more ({}): median {:.1} %, worst {:.1} % ({})",
                biases.len(),
                100.0 * median.0.abs(),
                100.0 * worst.0,
                worst.1,
            );
        }
    }
}
