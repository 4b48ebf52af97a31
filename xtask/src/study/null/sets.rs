//! Sets of runs that are scored in one command: equal ones, and ladders of errors.

use anyhow::Context as _;
use dmp_sensor::{Isometry3, Trajectory, Translation3, UnitQuaternion};
use dmp_sim::{Noise, SimError, SlamErrors};

use super::logs::NullLog;

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
/// A run bent by this is hardly worse, and as good when bent in the other direction; metres of a drive.
const BEND_M: f64 = 0.01;
/// Ladders: noise with a third of a degree to ten centimetres, and drift; metres of a drive.
const NOISE_LADDER: [f64; 4] = [0.01, 0.03, 0.1, 0.3];
const DRIFT_LADDER_M: [f64; 5] = [0.1, 0.3, 1.0, 3.0, 10.0];
const SMALL_NOISE_LADDER: [f64; 4] = [0.001, 0.002, 0.004, 0.007];
const SMALL_DRIFT_LADDER_M: [f64; 2] = [0.01, 0.03];
const DEG_PER_M: f64 = 10.0 / 3.0;

/// All sets of a log. Every run has another world.
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
