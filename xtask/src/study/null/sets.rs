//! Sets of runs that are scored in one command: equal ones, and ladders of errors.

use std::collections::BTreeMap;

use anyhow::Context as _;
use dmp::{Config, Frame, Run};
use dmp_sensor::{Isometry3, Trajectory, Translation3, UnitQuaternion};
use dmp_sim::{Noise, SimError, SlamErrors};

use super::logs::NullLog;
use super::sums::{AtScales, Estimated, Sums, Values};

/// What is true of the runs of a set.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum SetKind {
    /// They are the same but for where their worlds lie.
    Rigid,
    /// They are equally good.
    Equal,
    /// Each is better than those behind it on the same ladder, and the first is better than all.
    Ladder,
}

/// Runs of a log.
pub(super) struct Set {
    pub(super) name: String,
    pub(super) kind: SetKind,
    pub(super) runs: Vec<(String, Trajectory)>,
}

/// Noise of every pose, by its size along and about each axis: metres of a drive, degrees.
const NOISE: [(f64, f64); 3] = [(0.005, 0.02), (0.01, 0.05), (0.03, 0.1)];
/// A run bent by this is hardly worse, and bent the other way as good; metres of a drive.
const BEND_M: f64 = 0.01;
/// Ladders: noise with a third of a degree to ten centimetres, and drift; metres of a drive.
const NOISE_LADDER: [f64; 4] = [0.01, 0.03, 0.1, 0.3];
const DRIFT_LADDER_M: [f64; 5] = [0.1, 0.3, 1.0, 3.0, 10.0];
const SMALL_NOISE_LADDER: [f64; 4] = [0.001, 0.002, 0.004, 0.007];
const SMALL_DRIFT_LADDER_M: [f64; 2] = [0.01, 0.03];
const DEG_PER_M: f64 = 10.0 / 3.0;

/// All sets of a log. Every run lies in a world of its own.
pub(super) fn sets(log: &NullLog, draws: u64) -> anyhow::Result<Vec<Set>> {
    let metre_m = log.scales.lengths().metre_m;
    let mut sets = Vec::new();
    let copies = worlds(0).into_iter().enumerate();
    let copies = copies.map(|(k, world)| (format!("copy {k}"), log.base.moved(&world))).collect();
    sets.push(Set { name: "rigid copies".to_owned(), kind: SetKind::Rigid, runs: copies });
    for (noise_m, noise_deg) in NOISE {
        let draw = |seed: u64| {
            let errors = noise(log, noise_m * metre_m, noise_deg.to_radians(), seed);
            Ok((format!("draw {seed}"), elsewhere(&errors.apply(&log.base)?, seed)))
        };
        let runs = (1..=draws).map(draw).collect::<anyhow::Result<_>>()?;
        let name = format!("noise {} mm, {noise_deg}°", digits(1e3 * noise_m * metre_m));
        sets.push(Set { name, kind: SetKind::Equal, runs });
    }
    let bent = |bend_m: f64, seed| {
        let bend = SlamErrors { bend_m: Some(bend_m), ..errors(seed) };
        match bend.apply(&log.base) {
            Ok(bent) => Ok(Some((format!("bent {bend_m} m"), elsewhere(&bent, seed)))),
            // A robot that stands still.
            Err(SimError::NoTravel { .. }) => Ok(None),
            Err(error) => Err(error),
        }
    };
    let runs: Vec<_> =
        [bent(BEND_M * metre_m, 1)?, bent(-BEND_M * metre_m, 2)?].into_iter().flatten().collect();
    if runs.len() == 2 {
        let name = format!("bent by ±{} mm", digits(1e3 * BEND_M * metre_m));
        sets.push(Set { name, kind: SetKind::Equal, runs });
    }
    sets.push(ladder(log, "errors", &NOISE_LADDER, &DRIFT_LADDER_M)?);
    sets.push(ladder(log, "small errors", &SMALL_NOISE_LADDER, &SMALL_DRIFT_LADDER_M)?);
    Ok(sets)
}

fn digits(value: f64) -> f64 {
    (1e3 * value).round() / 1e3
}

fn errors(seed: u64) -> SlamErrors {
    SlamErrors { seed: 7000 + seed, ..SlamErrors::default() }
}

fn noise(log: &NullLog, sigma_m: f64, sigma_rad: f64, seed: u64) -> SlamErrors {
    let noise = Some(Noise { sigma_m, sigma_rad, interval_ns: log.period_ns });
    SlamErrors { noise, ..errors(seed) }
}

/// The run as it is, worse by more and more noise, and by more and more drift.
fn ladder(log: &NullLog, name: &str, noises_m: &[f64], drifts_m: &[f64]) -> anyhow::Result<Set> {
    let metre_m = log.scales.lengths().metre_m;
    let mut runs = vec![("base".to_owned(), elsewhere(&log.base, 0))];
    for (k, noise_m) in (1..).zip(noises_m) {
        let noisy = noise(log, noise_m * metre_m, (noise_m * DEG_PER_M).to_radians(), k).apply(&log.base)?;
        runs.push((format!("noise {noise_m}"), elsewhere(&noisy, k)));
    }
    for (k, drift_m) in (11..).zip(drifts_m) {
        let drift = SlamErrors { drift_ate_m: Some(drift_m * metre_m), ..errors(k) };
        match drift.apply(&log.base) {
            Ok(drifted) => runs.push((format!("drift {drift_m}"), elsewhere(&drifted, k))),
            Err(SimError::DriftNotReached { .. } | SimError::NoTravel { .. }) => {}
            Err(error) => return Err(error).with_context(|| format!("{}: drift {drift_m}", log.name)),
        }
    }
    Ok(Set { name: format!("ladder of {name}"), kind: SetKind::Ladder, runs })
}

/// A run in another world, drawn by a seed.
fn elsewhere(run: &Trajectory, seed: u64) -> Trajectory {
    let worlds = worlds(seed);
    run.moved(&worlds[seed as usize % worlds.len()])
}

/// Worlds as SLAM systems have them: at the first pose, upright somewhere, tilted, in UTM, upside down.
fn worlds(seed: u64) -> Vec<Isometry3<f64>> {
    let world = |place: [f64; 3], roll: f64, pitch: f64, yaw: f64| {
        Isometry3::from_parts(Translation3::from(place), UnitQuaternion::from_euler_angles(roll, pitch, yaw))
    };
    let by = 0.37 * seed as f64;
    vec![
        Isometry3::identity(),
        world([0.31 + by, -0.77, 0.49], 0.0, 0.0, 0.0),
        world([-12.3, 45.6 + by, 7.8], 0.0, 0.0, 2.1 + by),
        world([4.0, by, -9.0], 0.04, -0.05, -0.7 - by),
        world([432_100.25 + by, 4_649_776.5, 120.125], 0.01, 0.02, 0.9 + by),
        world([1.0 + by, 2.0, 3.0], std::f64::consts::PI, 0.0, by),
    ]
}

/// How much differences of equal runs, and scores, change when the grid of the voxels is moved: root mean squares over
/// pairs and over runs, in parts of their standard errors, at every scale.
pub(super) struct Grids {
    positions: u64,
    of_differences: Vec<(f64, f64)>,
    of_scores: Vec<(f64, f64)>,
}

/// Scores a few equal runs on grids that lie elsewhere each time.
pub(super) fn grids(log: &NullLog, positions: u64) -> anyhow::Result<Grids> {
    let mut runs = Vec::new();
    for seed in 1..=3 {
        let noisy =
            noise(log, 0.01 * log.scales.lengths().metre_m, 0.05_f64.to_radians(), seed).apply(&log.base)?;
        runs.push(Run::new(format!("draw {seed}"), noisy));
    }
    let mut found: Vec<AtScales> = Vec::new();
    for position in 0..positions {
        let world = worlds(position + 1).swap_remove(3);
        let config = Config { frame: Frame::Moved(world), ..Config::default() };
        let sums = Sums::new(log.log.frames().len(), runs.len(), log.scales);
        dmp::evaluate(log.log.as_ref(), &runs, &config, dmp::Watch::sink(&sums))?;
        found.push(AtScales::of(&sums.finish()));
    }
    Ok(Grids {
        positions,
        of_differences: spread(&found, |at| &at.differences),
        of_scores: spread(&found, |at| &at.scores),
    })
}

/// For each scale, the spread of values over the grids in parts of their standard error.
fn spread(found: &[AtScales], of: fn(&AtScales) -> &[Values]) -> Vec<(f64, f64)> {
    let Some(first) = found.first() else { return Vec::new() };
    let mut squares: BTreeMap<u64, Vec<f64>> = BTreeMap::new();
    for (index, scales) in of(first).iter().enumerate() {
        for (scale_m, _) in scales {
            let here =
                |at: &AtScales| of(at)[index].iter().find(|(m, _)| m == scale_m).map(|(_, value)| *value);
            let values: Vec<Estimated> = found.iter().filter_map(here).collect();
            let count = values.len() as f64;
            let mean_m2 = values.iter().map(|value| value.value_m2).sum::<f64>() / count;
            let error_m2 = values.iter().map(|value| value.error_m2.powi(2)).sum::<f64>() / count;
            let spread_m2 =
                values.iter().map(|value| (value.value_m2 - mean_m2).powi(2)).sum::<f64>() / (count - 1.0);
            squares.entry(scale_m.to_bits()).or_default().push(spread_m2 / error_m2);
        }
    }
    let mean = |(scale, squares): (&u64, &Vec<f64>)| {
        (f64::from_bits(*scale), (squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
    };
    squares.iter().rev().map(mean).collect()
}

impl Grids {
    pub(super) fn print(&self, log: &str) {
        let told = |of: &[(f64, f64)]| {
            of.iter().map(|(m, value)| format!("{value:.2} at {m} m")).collect::<Vec<_>>().join(", ")
        };
        println!(
            "{log:<14}grid at {} places: differences of equal runs spread by {}, scores by {} of their standard errors",
            self.positions,
            told(&self.of_differences),
            told(&self.of_scores)
        );
    }
}
