//! How high a walk leads: what is walked on, rounded where stairs begin and end.

use super::path::{Path, STEP_M, hermite};
use crate::town::walkable_m;

/// Heights are the mean over this many stations to either side, twice: a body does not jerk.
const SMOOTHING: usize = 2;

/// Height and slope at the stations of a path.
#[derive(Debug, Clone)]
pub(crate) struct Profile {
    heights_m: Vec<f64>,
    slopes: Vec<f64>,
}

impl Profile {
    /// Of a path over the campus.
    pub(crate) fn of_walk(path: &Path) -> Self {
        let mut heights_m: Vec<f64> = path.stations().iter().map(|at| walkable_m(at.x, at.y)).collect();
        let last = heights_m.len() - 1;
        for _ in 0..2 {
            let mean = |k: usize| {
                let near = &heights_m[k.saturating_sub(SMOOTHING)..=(k + SMOOTHING).min(last)];
                near.iter().sum::<f64>() / near.len() as f64
            };
            heights_m = (0..=last).map(mean).collect();
        }
        let slope = |k: usize| {
            let [before, after] = [k.saturating_sub(1), (k + 1).min(last)];
            (heights_m[after] - heights_m[before]) / ((after - before) as f64 * STEP_M)
        };
        Self { slopes: (0..=last).map(slope).collect(), heights_m }
    }

    /// Rise per metre at station `k`.
    pub(crate) fn slope(&self, k: usize) -> f64 {
        self.slopes[k]
    }

    /// Height, metres, and rise per metre after `path_m` of the line; clamped to the ends.
    pub(crate) fn at(&self, path_m: f64) -> (f64, f64) {
        let last = self.heights_m.len() - 2;
        let k = (path_m / STEP_M).clamp(0.0, last as f64) as usize;
        let u = (path_m / STEP_M - k as f64).clamp(0.0, 1.0);
        let ([h0, h1], [s0, s1]) =
            ([self.heights_m[k], self.heights_m[k + 1]], [self.slopes[k], self.slopes[k + 1]]);
        (hermite(h0, s0, h1, s1, u, STEP_M), s0 + (s1 - s0) * u)
    }
}
