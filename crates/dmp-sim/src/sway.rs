//! How a body sways about the line it follows: a car on its springs, a sensor carried by a walker.

use std::f64::consts::TAU;

use crate::random::Random;

/// A swaying motion: amplitude, frequency and phase of two waves.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sway([[f64; 3]; 2]);

impl Sway {
    pub(crate) fn new(amplitude: f64, random: &mut Random) -> Self {
        Self([0.6, 0.4].map(|share| [amplitude * share, random.between(0.4, 1.1), random.between(0.0, TAU)]))
    }

    /// Mostly in step with a gait of so many Hz.
    fn in_step(amplitude: f64, gait_hz: f64, random: &mut Random) -> Self {
        let slow_hz = random.between(0.3, 0.7);
        let wave = |share, hz, random: &mut Random| [amplitude * share, hz, random.between(0.0, TAU)];
        Self([wave(0.8, gait_hz, random), wave(0.2, slow_hz, random)])
    }

    const STILL: Self = Self([[0.0; 3]; 2]);

    /// Its value at `at`: seconds, or units of the way.
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
    /// To either side of the line, over units of the way of `beside_unit_m`.
    pub(crate) beside: Sway,
    pub(crate) beside_unit_m: f64,
}

impl Sways {
    /// Gentle, and waves of 40 to 100 m to either side: nobody keeps the middle of a lane.
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
}
