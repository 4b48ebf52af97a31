//! The ground along one direction, and where beams above each other meet it.

use dmp_sensor::Vector3;

use crate::city::terrain::Patch;

/// Ranges at which the ground is looked at: from the first, each farther by this factor than the one before.
const FIRST_M: f64 = 3.0;
const GROWTH: f64 = 1.25;
/// Newton's method takes its last step when it is this near to the ground, metres: what is left then is below
/// 10⁻⁵ m where a ray comes down by more than a hundredth of its range.
const NEAR_M: f64 = 2e-3;

/// Heights of the ground over an origin, by range along a heading.
#[derive(Debug, Clone, Default)]
pub(crate) struct Profile {
    ranges_m: Vec<f64>,
    heights_m: Vec<f64>,
}

/// Where a beam first is below the ground.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Crossing {
    /// The step at which it is.
    pub(crate) below: usize,
    /// Level ranges: of the step before, of the ground by a straight line between the two, and of the step.
    pub(crate) before_m: f64,
    pub(crate) about_m: f64,
    pub(crate) after_m: f64,
}

impl Profile {
    pub(crate) fn new(max_range_m: f64) -> Self {
        let mut ranges_m = vec![0.0];
        let mut range_m = FIRST_M;
        while range_m < max_range_m {
            ranges_m.push(range_m);
            range_m *= GROWTH;
        }
        ranges_m.push(max_range_m);
        Self { heights_m: vec![0.0; ranges_m.len()], ranges_m }
    }

    /// Looks at the ground from `origin` along a unit vector of the plane.
    pub(crate) fn look(&mut self, ground: &Patch, origin: Vector3<f64>, [x, y]: [f64; 2]) {
        for (height_m, range_m) in self.heights_m.iter_mut().zip(&self.ranges_m) {
            *height_m = ground.at(origin.x + x * range_m, origin.y + y * range_m).0 - origin.z;
        }
    }

    /// Where a beam that rises by `slope` first is below the ground, from the step of the beam below it on.
    /// `None` where it never is.
    pub(crate) fn first_below(&self, slope: f64, from_step: usize) -> Option<Crossing> {
        let above = |k: usize| slope * self.ranges_m[k] - self.heights_m[k];
        let below = (from_step.max(1)..self.ranges_m.len()).find(|&k| above(k) <= 0.0)?;
        let (before, after) = (above(below - 1), above(below));
        let share = if before > after { (before / (before - after)).clamp(0.0, 1.0) } else { 0.0 };
        let (before_m, after_m) = (self.ranges_m[below - 1], self.ranges_m[below]);
        Some(Crossing { below, before_m, about_m: before_m + (after_m - before_m) * share, after_m })
    }
}

/// Where a ray meets the ground near `range_m`, and the slope there; `None` where it just misses it.
pub(crate) fn refine(
    ground: &Patch,
    origin: Vector3<f64>,
    direction: Vector3<f64>,
    mut range_m: f64,
) -> Option<(f64, [f64; 2])> {
    for _ in 0..12 {
        let (x, y) = (origin.x + direction.x * range_m, origin.y + direction.y * range_m);
        let (height_m, slope) = ground.at(x, y);
        let above_m = origin.z + direction.z * range_m - height_m;
        let rate = direction.z - slope[0] * direction.x - slope[1] * direction.y;
        if rate > -1e-6 {
            return None;
        }
        range_m -= above_m / rate;
        if above_m.abs() < NEAR_M {
            return (range_m > 0.0).then_some((range_m, slope));
        }
    }
    None
}
