//! What stands in the streets: trees and poles along the façades, parked cars along the kerb.

use nalgebra::Vector3;

use super::relief::Relief;
use super::shape::Shape;
use super::solid::{Solid, Surface};
use crate::random::Random;

/// Along a street, nothing stands nearer than this to the middle of a crossing, metres.
pub(crate) const CROSSING_M: f64 = 10.5;

/// Distance of the lanes from the middle of the street, metres.
pub(crate) const LANE_M: f64 = 1.7;

/// A street from one crossing to the next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stretch {
    /// Middle of the first crossing, metres.
    pub(crate) start: [f64; 2],
    /// It leads east (0) or north (1).
    pub(crate) axis: usize,
    /// To the middle of the other crossing, metres.
    pub(crate) length_m: f64,
    /// From façade to façade, metres.
    pub(crate) width_m: f64,
    /// What is kept free from the middle of the first and of the other crossing, metres.
    pub(crate) clear_m: [f64; 2],
    /// Half the width of the street that crosses at the start, metres.
    pub(crate) corner_m: f64,
    /// Share of the kerb that has cars parked on it.
    pub(crate) parked: f64,
}

impl Stretch {
    /// On the ground, at a distance along the street, `side_m` to the right of its middle.
    pub(crate) fn place(&self, along_m: f64, side_m: f64, ground: &dyn Relief) -> Vector3<f64> {
        let [x, y] = if self.axis == 0 {
            [self.start[0] + along_m, self.start[1] - side_m]
        } else {
            [self.start[0] + side_m, self.start[1] + along_m]
        };
        Vector3::new(x, y, ground.height_m(x, y))
    }
}

/// Furnishes a stretch of street.
pub(crate) fn furnish_street(
    stretch: &Stretch,
    ground: &dyn Relief,
    random: &mut Random,
    solids: &mut Vec<Solid>,
) {
    let place = |along_m: f64, side_m: f64| stretch.place(along_m, side_m, ground);
    let half_m = stretch.width_m / 2.0;
    let [clear_m, end] = [stretch.clear_m[0], stretch.length_m - stretch.clear_m[1]];
    for side in [1.0, -1.0] {
        let mut along = clear_m + random.between(0.0, 3.0);
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
        let mut along = clear_m + 2.3;
        while along < end - 2.3 {
            if random.chance(stretch.parked) {
                let middle = place(along, side * (half_m - 2.0 + random.between(-0.1, 0.1)));
                let across = std::f64::consts::FRAC_PI_2 * stretch.axis as f64;
                let yaw = across + random.between(-0.04, 0.04);
                solids.extend(car(middle, yaw, random.between(0.08, 0.6), Surface::ParkedCar));
            }
            along += random.between(4.9, 5.8);
        }
    }
    // Lights and signs at the crossing itself.
    for side in [1.0, -1.0] {
        if random.chance(0.7) {
            let foot = place(stretch.corner_m - 0.5, side * (half_m - 0.5));
            put_pole(foot, random.between(2.5, 6.0), random.between(0.05, 0.1), solids);
        }
    }
}

pub(crate) fn put_pole(foot: Vector3<f64>, height_m: f64, radius_m: f64, solids: &mut Vec<Solid>) {
    let shape = Shape::Cylinder { foot: foot - Vector3::z(), radius_m, height_m: height_m + 1.0 };
    solids.push(Solid { shape, reflectivity: 0.4, surface: Surface::Pole });
}

pub(crate) fn plant_tree(foot: Vector3<f64>, random: &mut Random, solids: &mut Vec<Solid>) {
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
pub(crate) fn car(middle: Vector3<f64>, yaw_rad: f64, reflectivity: f64, surface: Surface) -> [Solid; 2] {
    let (sin_yaw, cos_yaw) = libm::sincos(yaw_rad);
    let part = |back_m: f64, height_m: f64, half: [f64; 3]| {
        let centre = middle + Vector3::new(-cos_yaw * back_m, -sin_yaw * back_m, height_m);
        let shape = Shape::Box { centre, half: Vector3::from(half), cos_yaw, sin_yaw };
        Solid { shape, reflectivity, surface }
    };
    [part(0.0, 0.6, [2.15, 0.88, 0.35]), part(0.25, 1.2, [1.15, 0.75, 0.27])]
}
