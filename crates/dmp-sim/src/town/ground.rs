//! The relief of the ground: a few long waves, known in closed form together with its slope.

use std::f64::consts::TAU;

use nalgebra::{Vector2, Vector3};

use crate::parts::relief::Relief;
use crate::parts::shape::Entry;
use crate::random::Random;

/// Wave lengths, metres, and each wave's share of the relief.
const WAVES: [(f64, f64); 5] = [(170.0, 0.42), (95.0, 0.28), (55.0, 0.18), (31.0, 0.08), (17.0, 0.04)];

#[derive(Debug, Clone, Copy, PartialEq)]
struct Wave {
    height_m: f64,
    /// Wave vector, radians per metre.
    vector: Vector2<f64>,
    phase_rad: f64,
}

/// A height over every place of the world.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Ground {
    waves: [Wave; WAVES.len()],
    /// No slope is steeper than this.
    steepest: f64,
}

impl Ground {
    /// Hills of about ± `relief_m` / 2.
    pub(crate) fn new(relief_m: f64, seed: u64) -> Self {
        let mut random = Random::new(seed, &[b'g'.into()]);
        let waves = WAVES.map(|(length_m, share)| {
            let heading = random.between(0.0, TAU);
            let vector = Vector2::new(libm::cos(heading), libm::sin(heading)) * (TAU / length_m);
            Wave { height_m: relief_m / 2.0 * share, vector, phase_rad: random.between(0.0, TAU) }
        });
        let steepest = waves.iter().map(|w| w.height_m * w.vector.norm()).sum();
        Self { waves, steepest }
    }

    /// Height and slope (∂z/∂x, ∂z/∂y) at a place.
    pub(crate) fn at(&self, x: f64, y: f64) -> (f64, Vector2<f64>) {
        let (mut height_m, mut slope) = (0.0, Vector2::zeros());
        for w in &self.waves {
            let (sin, cos) = libm::sincos(w.vector.x * x + w.vector.y * y + w.phase_rad);
            height_m += w.height_m * sin;
            slope += w.vector * (w.height_m * cos);
        }
        (height_m, slope)
    }

    /// Where the ray meets the ground before `far_m`; `None` where it does not, or starts below.
    ///
    /// Since no slope is steeper than `steepest`, the height above ground bounds the distance that can be
    /// gone without passing through; close to the ground, Newton's method ends the search.
    pub(crate) fn entry(&self, origin: Vector3<f64>, direction: Vector3<f64>, far_m: f64) -> Option<Entry> {
        let fastest_descent = self.steepest * libm::hypot(direction.x, direction.y) - direction.z;
        if fastest_descent <= 0.0 {
            return None;
        }
        let above = |range_m: f64| {
            let at = origin + direction * range_m;
            let (height_m, slope) = self.at(at.x, at.y);
            (at.z - height_m, direction.z - slope.x * direction.x - slope.y * direction.y, slope)
        };
        let mut range_m = 0.0;
        let (mut clearance, mut rate, mut slope) = above(range_m);
        if clearance < 0.0 {
            return None;
        }
        while clearance > 1e-3 {
            range_m += clearance / fastest_descent;
            if range_m > far_m {
                return None;
            }
            (clearance, rate, slope) = above(range_m);
        }
        for _ in 0..3 {
            if rate < -1e-6 {
                range_m -= clearance / rate;
                (clearance, rate, slope) = above(range_m);
            }
        }
        let normal = Vector3::new(-slope.x, -slope.y, 1.0).normalize();
        (range_m <= far_m).then_some(Entry { range_m, normal })
    }
}

impl Relief for Ground {
    fn height_m(&self, x: f64, y: f64) -> f64 {
        self.at(x, y).0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn level_ground_is_a_plane() {
        let ground = Ground::new(0.0, 1);
        let down = Vector3::new(0.6, 0.0, -0.8);
        let entry = ground.entry(Vector3::new(3.0, 4.0, 2.0), down, 100.0).unwrap();
        assert!((entry.range_m - 2.5).abs() < 1e-12);
        assert!((entry.normal - Vector3::z()).norm() < 1e-15);
        assert_eq!(ground.entry(Vector3::new(0.0, 0.0, 2.0), Vector3::x(), 100.0), None);
        assert_eq!(ground.entry(Vector3::new(0.0, 0.0, 2.0), down, 2.4), None);
        assert_eq!(ground.entry(Vector3::new(0.0, 0.0, -1.0), down, 100.0), None);
    }

    #[test]
    fn hills_are_met_on_their_surface_and_not_passed_through() {
        let ground = Ground::new(4.0, 3);
        let mut random = Random::new(5, &[]);
        let mut met = 0;
        for _ in 0..500 {
            let (x, y) = (random.between(-300.0, 300.0), random.between(-300.0, 300.0));
            let origin = Vector3::new(x, y, ground.height_m(x, y) + 2.0);
            let heading = random.between(0.0, TAU);
            let direction =
                Vector3::new(libm::cos(heading), libm::sin(heading), random.between(-0.3, 0.05)).normalize();
            let entry = ground.entry(origin, direction, 150.0);
            let range_m = entry.map_or(150.0, |e| e.range_m);
            for k in 0..1000 {
                let at = origin + direction * (range_m * f64::from(k) / 1000.0);
                assert!(at.z > ground.height_m(at.x, at.y) - 1e-9, "passed through at {at:?}");
            }
            if let Some(entry) = entry {
                let at = origin + direction * entry.range_m;
                assert!((at.z - ground.height_m(at.x, at.y)).abs() < 1e-6);
                met += 1;
            }
        }
        assert!(met > 300, "{met}");
    }

    #[test]
    fn the_slope_is_the_derivative() {
        let ground = Ground::new(4.0, 9);
        let (h, slope) = ground.at(12.0, -7.0);
        let step = 1e-5;
        assert!(((ground.height_m(12.0 + step, -7.0) - h) / step - slope.x).abs() < 1e-5);
        assert!(((ground.height_m(12.0, -7.0 + step) - h) / step - slope.y).abs() < 1e-5);
        assert!(slope.norm() < ground.steepest);
    }
}
