//! What stands in the streets: trees and poles along the façades, parked cars along the kerb.

use nalgebra::Vector3;

use super::ground::Ground;
use super::shape::Shape;
use super::{Solid, Surface, TownOptions};
use crate::random::Random;

/// Along a street, nothing stands nearer than this to the middle of a crossing, metres.
const CROSSING_M: f64 = 10.5;

/// Furnishes the stretch of street from the crossing `node` to the next, east (`axis` 0) or north (1).
pub(super) fn furnish_street(
    node: [usize; 2],
    axis: usize,
    options: &TownOptions,
    ground: &Ground,
    random: &mut Random,
    solids: &mut Vec<Solid>,
) {
    let start = [0, 1].map(|k| node[k] as f64 * options.block_m[k]);
    let place = |along_m: f64, side_m: f64| {
        let [x, y] = if axis == 0 {
            [start[0] + along_m, start[1] - side_m]
        } else {
            [start[0] + side_m, start[1] + along_m]
        };
        Vector3::new(x, y, ground.height_m(x, y))
    };
    let half_m = options.street_m / 2.0;
    let end = options.block_m[axis] - CROSSING_M;
    for side in [1.0, -1.0] {
        let mut along = CROSSING_M + random.between(0.0, 3.0);
        while along < end {
            let foot = place(along, side * (half_m - 0.9));
            match random.index(10) {
                0..4 => plant_tree(foot, random, solids),
                4..7 => put_pole(foot, random.between(3.0, 7.0), random.between(0.05, 0.12), solids),
                7 => put_pole(foot, random.between(0.9, 1.3), random.between(0.2, 0.35), solids),
                _ => {}
            }
            along += random.between(4.0, 8.0);
        }
        let mut along = CROSSING_M + 2.3;
        while along < end - 2.3 {
            if random.chance(options.parked) {
                let middle = place(along, side * (half_m - 2.0 + random.between(-0.1, 0.1)));
                let across = std::f64::consts::FRAC_PI_2 * axis as f64;
                let yaw = across + random.between(-0.04, 0.04);
                solids.extend(car(middle, yaw, random.between(0.08, 0.6), Surface::ParkedCar));
            }
            along += random.between(4.9, 5.8);
        }
    }
    // Lights and signs at the crossing itself.
    for side in [1.0, -1.0] {
        if random.chance(0.7) {
            let foot = place(half_m - 0.5, side * (half_m - 0.5));
            put_pole(foot, random.between(2.5, 6.0), random.between(0.05, 0.1), solids);
        }
    }
}

pub(super) fn put_pole(foot: Vector3<f64>, height_m: f64, radius_m: f64, solids: &mut Vec<Solid>) {
    let shape = Shape::Cylinder { foot: foot - Vector3::z(), radius_m, height_m: height_m + 1.0 };
    solids.push(Solid { shape, reflectivity: 0.4, surface: Surface::Pole });
}

pub(super) fn plant_tree(foot: Vector3<f64>, random: &mut Random, solids: &mut Vec<Solid>) {
    let crown_m = random.between(3.6, 5.0);
    let (radius_m, foot_m) = (random.between(0.1, 0.22), foot - Vector3::z());
    let trunk = Shape::Cylinder { foot: foot_m, radius_m, height_m: crown_m + 1.0 };
    solids.push(Solid { shape: trunk, reflectivity: 0.3, surface: Surface::Plant });
    let reach = random.between(1.0, 1.8);
    let half = Vector3::new(reach, reach, random.between(0.8, 1.5));
    for _ in 0..24 {
        let shape = Shape::leaves(foot + Vector3::new(0.0, 0.0, crown_m), half, random);
        solids.push(Solid { shape, reflectivity: 0.4, surface: Surface::Plant });
    }
}

/// A car on the ground at `middle`: a body and a cabin.
pub(super) fn car(middle: Vector3<f64>, yaw_rad: f64, reflectivity: f64, surface: Surface) -> [Solid; 2] {
    let (sin_yaw, cos_yaw) = libm::sincos(yaw_rad);
    let part = |back_m: f64, height_m: f64, half: [f64; 3]| {
        let centre = middle + Vector3::new(-cos_yaw * back_m, -sin_yaw * back_m, height_m);
        let shape = Shape::Box { centre, half: Vector3::from(half), cos_yaw, sin_yaw };
        Solid { shape, reflectivity, surface }
    };
    [part(0.0, 0.6, [2.15, 0.88, 0.35]), part(0.25, 1.2, [1.15, 0.75, 0.27])]
}
