//! What SLAM systems might have made of a walk through a room, from good to collapsed.

use dmp_sensor::{Isometry3, Trajectory, UnitQuaternion, Vector3};

use crate::error::SimError;
use crate::errors::{Noise, SlamErrors, ate_rmse_m, close_loop};
use crate::random::Random;

/// Number of instants of a run at which the rates of error change, and over how many of them they are correlated.
const KNOTS: usize = 40;
const MEMORY: f64 = 12.0;
/// Drift of the heading for each metre of drift in place, radians.
const TURN_PER_M: f64 = 0.08;
/// Of every pose, along and about each axis.
const JITTER_M: f64 = 0.001;
const JITTER_RAD: f64 = 0.0004;
/// What the trajectories are off by, metres RMSE.
const GOOD_M: f64 = 0.01;
const ANOTHER_M: f64 = 0.024;
const ODOMETRY_M: f64 = 0.08;
const OFF_M: f64 = 0.3;
const FALSE_LOOP_M: f64 = 0.8;
/// Places this close to each other are one, to which a run comes back, metres.
const BACK_M: f64 = 1.0;

/// What a SLAM system might have put out, and what is wrong with it.
#[derive(Debug, Clone, PartialEq)]
pub struct RoomEstimate {
    /// `good`, `another`, `odometry`, `off`, `false_loop`.
    pub name: &'static str,
    /// What it is.
    pub what: &'static str,
    /// `world_from_camera`, with the stamps of the truth.
    pub trajectory: Trajectory,
}

/// Five estimates of a run in a room, as in the figure of Zhang & Chen 2021: from good ones to a collapsed one, by
/// absolute trajectory error. The same seed gives the same estimates, to the bit.
///
/// # Errors
/// When the run does not move, or is too small to be off by that much.
pub fn room_estimates(truth: &Trajectory, seed: u64) -> Result<[RoomEstimate; 5], SimError> {
    let drifted =
        |which: u64, ate_m: f64| to_ate(truth, ate_m, |strength| drift(truth, seed, which, strength));
    let closed = |which: u64, ate_m: f64| {
        to_ate(truth, ate_m, |strength| {
            let wrong = drift(truth, seed, which, strength)?;
            if comes_back(truth) { close_loop(&wrong, truth) } else { Ok(wrong) }
        })
    };
    let estimate = |name, what, trajectory| RoomEstimate { name, what, trajectory };
    let what_of = if comes_back(truth) {
        ["drift that a loop closure has spread", "more drift, spread"]
    } else {
        ["little drift", "more drift"]
    };
    Ok([
        estimate("good", what_of[0], closed(0, GOOD_M)?),
        estimate("another", what_of[1], closed(1, ANOTHER_M)?),
        estimate("odometry", "drift", drifted(2, ODOMETRY_M)?),
        estimate("off", "drift of a system that is nearly lost", drifted(3, OFF_M)?),
        estimate("false_loop", "two places mapped onto each other", false_loop(truth, seed)?),
    ])
}

fn comes_back(truth: &Trajectory) -> bool {
    let poses = truth.poses();
    let ends = poses[poses.len() - 1].translation.vector - poses[0].translation.vector;
    ends.norm() < BACK_M
}

/// The truth with smooth errors of rate, summed up in the camera's frame, and a jitter of each pose.
fn drift(truth: &Trajectory, seed: u64, which: u64, strength: f64) -> Result<Trajectory, SimError> {
    let mut random = Random::new(seed, &[b'r'.into(), b'e'.into(), which]);
    let mut rate = [0.0; 6];
    let rates: Vec<[f64; 6]> = (0..=KNOTS + 1)
        .map(|_| {
            rate = rate.map(|here| here * (1.0 - 1.0 / MEMORY) + random.normal());
            rate
        })
        .collect();
    let poses = truth.poses();
    let mut at = poses[0];
    let mut wrong = vec![at];
    for (k, pair) in poses.windows(2).enumerate() {
        let place = (k as f64 + 0.5) / (poses.len() - 1) as f64 * KNOTS as f64;
        let (knot, u) = (place as usize, place - libm::floor(place));
        let share = strength / (poses.len() - 1) as f64;
        let now: [f64; 6] =
            std::array::from_fn(|n| (rates[knot][n] * (1.0 - u) + rates[knot + 1][n] * u) * share);
        let shift = Vector3::new(now[0], now[1], now[2]);
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(now[3], now[4], now[5]) * TURN_PER_M);
        at *= pair[0].inv_mul(&pair[1]) * Isometry3::from_parts(shift.into(), turn);
        // The product of many rotations: keep it one.
        at.rotation.renormalize();
        wrong.push(at);
    }
    let wrong = match truth.stamps_ns() {
        Some(stamps_ns) => Trajectory::stamped(stamps_ns.iter().copied().zip(wrong).collect())?.trajectory,
        None => Trajectory::unstamped(wrong)?,
    };
    jittered(&wrong, seed ^ which)
}

fn jittered(run: &Trajectory, seed: u64) -> Result<Trajectory, SimError> {
    let noise = Some(Noise { sigma_m: JITTER_M, sigma_rad: JITTER_RAD, interval_ns: 1 });
    SlamErrors { seed, noise, ..SlamErrors::default() }.apply(run)
}

/// The estimate whose strength gives it an absolute trajectory error, to 1 %.
fn to_ate(
    truth: &Trajectory,
    ate_m: f64,
    make: impl Fn(f64) -> Result<Trajectory, SimError>,
) -> Result<Trajectory, SimError> {
    let (mut low, mut high) = (0.0, ate_m * 0.1);
    let mut largest_m: f64 = 0.0;
    loop {
        let reached_m = ate_rmse_m(&make(high)?, truth);
        if reached_m >= ate_m {
            break;
        }
        largest_m = largest_m.max(reached_m);
        (low, high) = (high, high * 2.0);
        if high > 1e3 {
            return Err(SimError::DriftNotReached { asked_m: ate_m, largest_m });
        }
    }
    for _ in 0..60 {
        let middle = f64::midpoint(low, high);
        let made = make(middle)?;
        let reached_m = ate_rmse_m(&made, truth);
        if (reached_m / ate_m - 1.0).abs() < 0.01 {
            return Ok(made);
        }
        if reached_m < ate_m { low = middle } else { high = middle }
    }
    make(high)
}

/// Two places mapped onto each other, as far apart as makes the run off by what it is to be off by.
fn false_loop(truth: &Trajectory, seed: u64) -> Result<Trajectory, SimError> {
    let mut best: Option<(f64, Trajectory)> = None;
    let mut last = SimError::NoTravel { what: "a false loop" };
    for tenths in 8..60 {
        let jump_m = f64::from(tenths) * 0.1;
        let errors = SlamErrors { seed, false_loop_m: Some(jump_m), ..SlamErrors::default() };
        match errors.apply(truth) {
            Ok(wrong) => {
                let off_m = (ate_rmse_m(&wrong, truth) - FALSE_LOOP_M).abs();
                if best.as_ref().is_none_or(|(least_m, _)| off_m < *least_m) {
                    best = Some((off_m, wrong));
                }
            }
            Err(error) => last = error,
        }
    }
    let (_, wrong) = best.ok_or(last)?;
    jittered(&wrong, seed)
}
