//! Drift that grows with the travel.

use dmp_sensor::{Isometry3, UnitQuaternion, Vector3};

use super::align::aligned_rmse_m;
use super::poses::{Poses, Travel};
use crate::error::SimError;
use crate::random::Random;

/// The rates of error change their mind at this distance, metres, and forget over `MEMORY_M`.
const KNOT_M: f64 = 5.0;
const MEMORY_M: f64 = 100.0;
/// At strength 1: change of the rates from knot to knot. Rotations in rad/m, steps as a share of their length.
const TURN: f64 = 1e-5;
const TILT: f64 = 2e-6;
const STRETCH: f64 = 2e-4;
/// No step is longer or shorter by more than this share: beyond it, a run is not a drifting one any more.
const LARGEST_STRETCH: f64 = 0.5;

/// Rates of error at knots along the travel: three rotations about the world's axes and one stretch.
struct Rates(Vec<[f64; 4]>);

impl Rates {
    fn new(total_m: f64, seed: u64) -> Self {
        let mut random = Random::new(seed, &[b'e'.into(), b'd'.into()]);
        let mut rate = [0.0; 4];
        let knots = (total_m / KNOT_M).ceil() as usize + 2;
        let next = |_| {
            let here = rate;
            let change = [TILT, TILT, TURN, STRETCH].map(|size| size * random.normal());
            rate = std::array::from_fn(|k| here[k] * (1.0 - KNOT_M / MEMORY_M) + change[k]);
            here
        };
        Self((0..knots).map(next).collect())
    }

    fn at(&self, travel_m: f64) -> [f64; 4] {
        let knot = ((travel_m / KNOT_M) as usize).min(self.0.len() - 2);
        let u = travel_m / KNOT_M - knot as f64;
        std::array::from_fn(|k| self.0[knot][k] * (1.0 - u) + self.0[knot + 1][k] * u)
    }

    fn largest_stretch(&self) -> f64 {
        self.0.iter().map(|rate| rate[3].abs()).fold(0.0, f64::max)
    }
}

/// The run with its errors summed up, `strength` times as large as they were drawn.
fn drifted(poses: &[Isometry3<f64>], travel: &Travel, rates: &Rates, strength: f64) -> Poses {
    let mut error = UnitQuaternion::identity();
    let mut wrong = poses.to_vec();
    for k in 0..poses.len() - 1 {
        let [x, y, z, stretch] = rates.at(travel.middle_m(k)).map(|rate| rate * strength);
        let step = poses[k + 1].translation.vector - poses[k].translation.vector;
        wrong[k + 1].translation.vector = wrong[k].translation.vector + error * step * (1.0 + stretch);
        error *= UnitQuaternion::from_scaled_axis(Vector3::new(x, y, z) * (travel.0[k + 1] - travel.0[k]));
        // The sum of many small turns: keep it a rotation.
        error.renormalize();
        wrong[k + 1].rotation = error * poses[k + 1].rotation;
    }
    wrong
}

/// Bends the run by a drift of the given absolute trajectory error.
pub(super) fn drift(poses: &mut Poses, travel: &Travel, ate_m: f64, seed: u64) -> Result<(), SimError> {
    let rates = Rates::new(travel.total_m(), seed);
    let largest = LARGEST_STRETCH / rates.largest_stretch().max(1e-12);
    let attempt = |strength: f64| {
        let wrong = drifted(poses, travel, &rates, strength);
        let rmse_m = aligned_rmse_m(&wrong, poses);
        (wrong, rmse_m)
    };
    // The error grows with the strength, from 0 without a jump: double until it is too large, then halve.
    let (mut low, mut high) = (0.0, 0.01);
    let mut largest_m: f64 = 0.0;
    loop {
        let (_, rmse_m) = attempt(high);
        if rmse_m >= ate_m {
            break;
        }
        largest_m = largest_m.max(rmse_m);
        (low, high) = (high, high * 2.0);
        if low > largest {
            return Err(SimError::DriftNotReached { asked_m: ate_m, largest_m });
        }
    }
    let mut found = attempt(high);
    for _ in 0..100 {
        if (found.1 / ate_m - 1.0).abs() < 1e-3 {
            break;
        }
        let middle = f64::midpoint(low, high);
        found = attempt(middle);
        if found.1 < ate_m {
            low = middle;
        } else {
            high = middle;
        }
    }
    *poses = found.0;
    Ok(())
}
