//! How a body sways about the line it follows: a car on its springs, a sensor carried by a walker.

use std::f64::consts::TAU;

use dmp_sensor::{Isometry3, Translation3, UnitQuaternion};

use super::path::Station;
use crate::random::Random;

/// A swaying motion: amplitude, frequency and phase of two waves.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sway([[f64; 3]; 2]);

impl Sway {
    pub(crate) fn new(amplitude: f64, random: &mut Random) -> Self {
        Self([0.6, 0.4].map(|share| [amplitude * share, random.between(0.4, 1.1), random.between(0.0, TAU)]))
    }

    /// Mostly in step with a gait, Hz.
    fn in_step(amplitude: f64, gait_hz: f64, random: &mut Random) -> Self {
        let slow_hz = random.between(0.3, 0.7);
        let wave = |share, hz, random: &mut Random| [amplitude * share, hz, random.between(0.0, TAU)];
        Self([wave(0.8, gait_hz, random), wave(0.2, slow_hz, random)])
    }

    const STILL: Self = Self([[0.0; 3]; 2]);

    /// Its value at `at`: seconds, or units of path length.
    pub(crate) fn at(&self, at: f64) -> f64 {
        self.0
            .iter()
            .map(|[amplitude, frequency, phase]| amplitude * libm::sin(TAU * frequency * at + phase))
            .sum()
    }
}

/// All of a body's sways: angles in radians, the rest in metres.
#[derive(Debug, Clone)]
pub(crate) struct Sways {
    pub(crate) pitch: Sway,
    pub(crate) roll: Sway,
    pub(crate) yaw: Sway,
    pub(crate) heave: Sway,
    /// To either side of the line, over units of path length of `beside_unit_m`.
    pub(crate) beside: Sway,
    pub(crate) beside_unit_m: f64,
}

impl Sways {
    /// Gentle, and waves of 40 to 100 m to either side: no driver keeps the middle of a lane.
    pub(crate) fn of_car(seed: u64) -> Self {
        let mut random = Random::new(seed, &[b'd'.into(), b's'.into()]);
        let [pitch, roll, heave, beside] = [0.005, 0.006, 0.012, 0.25].map(|a| Sway::new(a, &mut random));
        Self { pitch, roll, yaw: Sway::STILL, heave, beside, beside_unit_m: 40.0 }
    }

    /// Up, down and nodding with every step, about two a second; from side to side with every second one.
    pub(crate) fn of_walker(seed: u64) -> Self {
        let mut random = Random::new(seed, &[b'd'.into(), b'w'.into()]);
        let steps_hz = random.between(1.8, 2.1);
        let mut in_step = |amplitude, hz| Sway::in_step(amplitude, hz, &mut random);
        let (pitch, heave) = (in_step(0.015, steps_hz), in_step(0.025, steps_hz));
        let (roll, yaw) = (in_step(0.02, steps_hz / 2.0), in_step(0.03, steps_hz / 2.0));
        Self { pitch, roll, yaw, heave, beside: Sway::new(0.12, &mut random), beside_unit_m: 8.0 }
    }

    /// Place and heading (x, y, yaw) of a body at a point of its line, after `path_m` of it.
    pub(crate) fn on_map(&self, at: &Station, path_m: f64) -> [f64; 3] {
        let Self { beside, beside_unit_m: unit_m, .. } = self;
        let beside_m = beside.at(path_m / unit_m);
        let step_m = 1e-3;
        let drift = (beside.at((path_m + step_m) / unit_m) - beside_m) / step_m;
        let (sin, cos) = libm::sincos(at.heading_rad);
        let (x, y) = (at.x - sin * beside_m, at.y + cos * beside_m);
        let yaw = at.heading_rad + libm::atan2(drift, 1.0 - at.curvature * beside_m);
        [x, y, yaw]
    }

    /// The body's pose: where it is on the map, how it stands there, `height_m` above the floor.
    pub(crate) fn pose(
        &self,
        [x, y, yaw]: [f64; 3],
        stance: &Stance,
        height_m: f64,
        time_s: f64,
    ) -> Isometry3<f64> {
        let pitch = stance.pitch + self.pitch.at(time_s);
        let roll = stance.roll + self.roll.at(time_s);
        let yaw = yaw + self.yaw.at(time_s);
        let z = stance.floor_m + height_m + self.heave.at(time_s);
        Isometry3::from_parts(Translation3::new(x, y, z), UnitQuaternion::from_euler_angles(roll, pitch, yaw))
    }
}

/// How the floor lies under a body: its height in metres, and the body's tilt on it in radians.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stance {
    pub(crate) floor_m: f64,
    pub(crate) pitch: f64,
    pub(crate) roll: f64,
}

impl Stance {
    /// Of a car that stands on ground of such a slope (∂z/∂x, ∂z/∂y).
    pub(crate) fn on_ground(floor_m: f64, [slope_x, slope_y]: [f64; 2], yaw: f64) -> Self {
        let (sin, cos) = libm::sincos(yaw);
        // Uphill lifts the nose (negative pitch), rising ground on the left lifts the left side.
        let pitch = -libm::atan(slope_x * cos + slope_y * sin);
        Self { floor_m, pitch, roll: libm::atan(slope_y * cos - slope_x * sin) }
    }
}
