//! Cars that drive along the streets of a town.

use nalgebra::Vector3;

use super::options::TownOptions;
use crate::parts::relief::Relief;
use crate::parts::solid::{Solid, Surface};
use crate::parts::street::{LANE_M, car};
use crate::random::Random;

/// A car keeps this far from a sensor in its own lane, metres.
const DISTANCE_M: f64 = 10.0;
/// Cars turn up this far outside the town, and vanish there.
const OUTSKIRTS_M: f64 = 25.0;

/// A car that drives along one street for ever: at its end, it starts again at the beginning.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct MovingCar {
    start: [f64; 2],
    heading: [f64; 2],
    yaw_rad: f64,
    length_m: f64,
    /// Place along the street at time 0.
    along_m: f64,
    speed_m_s: f64,
    reflectivity: f64,
}

impl MovingCar {
    pub(super) fn new(car: usize, options: &TownOptions) -> Self {
        let mut random = Random::new(options.seed, &[b'm'.into(), car as u64]);
        let axis = random.index(2);
        let across = 1 - axis;
        // The streets at the rim lead nowhere; inner ones are used first.
        let inner = options.blocks[across].saturating_sub(1).max(1);
        let street = (1 + random.index(inner)) as f64 * options.block_m[across];
        let length_m = options.blocks[axis] as f64 * options.block_m[axis] + 2.0 * OUTSKIRTS_M;
        let sign = if random.chance(0.5) { 1.0 } else { -1.0 };
        let mut heading = [0.0; 2];
        heading[axis] = sign;
        let mut start = [0.0; 2];
        start[axis] = if sign > 0.0 { -OUTSKIRTS_M } else { length_m - OUTSKIRTS_M };
        // Traffic keeps right: right of the heading (x, y) is (y, -x).
        start[across] = street + if axis == 0 { -sign } else { sign } * LANE_M;
        Self {
            start,
            heading,
            yaw_rad: libm::atan2(heading[1], heading[0]),
            length_m,
            along_m: random.between(0.0, length_m),
            speed_m_s: random.between(5.0, 10.0),
            reflectivity: random.between(0.08, 0.6),
        }
    }

    /// Its parts at `time_s`, if the ray comes near it before `far_m`.
    pub(super) fn solids_near_ray(
        &self,
        origin: Vector3<f64>,
        direction: Vector3<f64>,
        far_m: f64,
        time_s: f64,
        ground: &dyn Relief,
    ) -> Option<[Solid; 2]> {
        let along_m = (self.along_m + self.speed_m_s * time_s).rem_euclid(self.length_m);
        let [x, y] = [0, 1].map(|k| self.start[k] + self.heading[k] * along_m);
        let (dx, dy) = (x - origin.x, y - origin.y);
        let (ahead, beside) =
            (dx * self.heading[0] + dy * self.heading[1], dy * self.heading[0] - dx * self.heading[1]);
        let follows = ahead.abs() < DISTANCE_M && beside.abs() < LANE_M;
        let level = direction.x * direction.x + direction.y * direction.y;
        let nearest = ((dx * direction.x + dy * direction.y) / level.max(1e-12)).clamp(0.0, far_m);
        let (gap_x, gap_y) = (dx - direction.x * nearest, dy - direction.y * nearest);
        let reach_m = 2.5;
        if follows || gap_x * gap_x + gap_y * gap_y > reach_m * reach_m {
            return None;
        }
        let middle = Vector3::new(x, y, ground.height_m(x, y));
        Some(car(middle, self.yaw_rad, self.reflectivity, Surface::MovingCar))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::town::ground::Ground;

    #[test]
    fn a_car_is_met_where_it_is_at_that_time_and_only_in_its_lane() {
        let options = TownOptions { relief_m: 0.0, ..TownOptions::default() };
        let ground = Ground::new(0.0, 1);
        let car = MovingCar { along_m: 40.0, speed_m_s: 5.0, ..MovingCar::new(0, &options) };
        for time_s in [0.0, 1.0, 3.0] {
            let along_m = (40.0 + 5.0 * time_s) % car.length_m;
            let at = [0, 1].map(|k| car.start[k] + car.heading[k] * along_m);
            // From 6 m to its right, at the height of its body, looking left.
            let right = Vector3::new(car.heading[1], -car.heading[0], 0.0);
            let origin = Vector3::new(at[0], at[1], 0.6) + right * 6.0;
            let parts = car.solids_near_ray(origin, -right, 50.0, time_s, &ground).unwrap();
            let entry = parts[0].shape.entry(origin, -right).unwrap();
            assert!((entry.range_m - (6.0 - 0.88)).abs() < 1e-9, "{entry:?}");
            assert!(car.solids_near_ray(origin, right, 50.0, time_s, &ground).is_none());
            // A sensor in the same lane never sees it near.
            let ahead = origin - right * 6.0 + Vector3::new(car.heading[0], car.heading[1], 0.0) * 6.0;
            let back = -Vector3::new(car.heading[0], car.heading[1], 0.0);
            assert!(car.solids_near_ray(ahead, back, 50.0, time_s, &ground).is_none());
        }
    }
}
