//! The beams of a sensor in the order of their elevation, and which of them may meet what lies between two
//! slopes.

use crate::city::column::LANES;

/// Steps of the table of slopes.
const STEPS: usize = 1024;

#[derive(Debug, Clone)]
pub(crate) struct Beams {
    /// Sine and cosine of each beam's elevation.
    pub(crate) elevations: Vec<(f64, f64)>,
    /// The same by group: sines, cosines. Those of beams that are not there are of a level one.
    pub(crate) lanes: Vec<[[f64; LANES]; 2]>,
    /// Slope of the lowest beam, and steps per unit of slope.
    lowest: f32,
    scale: f32,
    /// By step of the slope: beams below its start, and beams up to its end.
    below: Vec<u16>,
    up_to: Vec<u16>,
}

impl Beams {
    /// Of sine and cosine of their elevations, lowest first.
    pub(crate) fn new(elevations: &[(f64, f64)]) -> Self {
        let slopes: Vec<f32> = elevations.iter().map(|(sin, cos)| (sin / cos) as f32).collect();
        let (lowest, highest) = (slopes[0], slopes[slopes.len() - 1]);
        let scale = (STEPS as f32 - 1.0) / (highest - lowest).max(1e-6);
        // A step may be off by one where the arithmetic rounds.
        let edge = |step: f32| lowest + step / scale;
        let below = |k: usize| slopes.partition_point(|&slope| slope < edge(k as f32 - 1.0)) as u16;
        let up_to = |k: usize| slopes.partition_point(|&slope| slope <= edge(k as f32 + 2.0)) as u16;
        let lanes = elevations.chunks(LANES).map(|group| {
            let at = |l: usize| group.get(l).copied().unwrap_or((0.0, 1.0));
            [std::array::from_fn(|l| at(l).0), std::array::from_fn(|l| at(l).1)]
        });
        Self {
            lanes: lanes.collect(),
            elevations: elevations.to_vec(),
            lowest,
            scale,
            below: (0..STEPS).map(below).collect(),
            up_to: (0..STEPS).map(up_to).collect(),
        }
    }

    /// The groups of beams that may meet what is seen between two slopes, from–to; `None` for none.
    pub(crate) fn groups(&self, low: f32, high: f32) -> Option<[u8; 2]> {
        let step = |slope: f32| (slope - self.lowest) * self.scale;
        let (low, high) = (step(low), step(high));
        if high < -2.0 || low > STEPS as f32 + 1.0 {
            return None;
        }
        let index = |step: f32| step.clamp(0.0, STEPS as f32 - 1.0) as usize;
        let (first, end) = (self.below[index(low)] as usize, self.up_to[index(high)] as usize);
        (first < end).then(|| [(first / LANES) as u8, ((end - 1) / LANES) as u8])
    }

    /// Number of groups.
    pub(crate) fn group_count(&self) -> usize {
        self.elevations.len().div_ceil(LANES)
    }
}
