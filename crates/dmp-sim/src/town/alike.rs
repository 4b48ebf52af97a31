//! Streets that look the same everywhere along: whatever stands there is one thing, put again at every period.
//!
//! Periods are counted from the middles of the crossings, and a block has a whole number of them, so that all streets
//! and all blocks are alike too.

use std::f64::consts::FRAC_PI_2;

use nalgebra::Vector3;

use crate::error::{SimError, require};
use crate::parts::building::build_same_houses;
use crate::parts::relief::Relief;
use crate::parts::shape::Shape;
use crate::parts::solid::{GROUND_REFLECTIVITY, Solid, Surface};
use crate::parts::street::{Stretch, car, plant_tree, put_pole};
use crate::random::Random;

/// Half of the gap between two houses, metres.
const HALF_GAP_M: f64 = 0.8;
/// The pavement before the houses: its width, its height above the street, and how much of each period is left open
/// for cars to cross, metres.
const PAVEMENT_M: f64 = 1.1;
const KERB_M: f64 = 0.13;
const DROPPED_M: f64 = 2.5;

/// Refuses what is not the same after a period.
pub(super) fn check(period_m: f64, block_m: [f64; 2], relief_m: f64) -> Result<(), SimError> {
    check_period(period_m)?;
    for length_m in block_m {
        let periods = length_m / period_m;
        let whole = (periods - periods.round()).abs() < 1e-9;
        require(whole, "the length of a block of houses that are alike in m", "whole periods", length_m)?;
    }
    require(relief_m == 0.0, "the relief in m of streets that are alike", "0", relief_m)
}

fn check_period(period_m: f64) -> Result<(), SimError> {
    require((6.0..=40.0).contains(&period_m), "the period of what is alike in m", "from 6 to 40", period_m)
}

/// Blocks of at least `least_m` that have whole periods, metres.
pub(super) fn blocks_m(period_m: f64, least_m: [f64; 2]) -> Result<[f64; 2], SimError> {
    check_period(period_m)?;
    Ok(least_m.map(|least_m| (least_m / period_m).ceil() * period_m))
}

/// Where the whole periods within from–to start, counted from 0.
fn periods(period_m: f64, [from_m, to_m]: [f64; 2]) -> impl Iterator<Item = f64> {
    let [first, end] = [(from_m / period_m).ceil() as usize, (to_m / period_m).floor() as usize];
    (first..end).map(move |n| n as f64 * period_m)
}

/// Houses round the block from its south-western `corner`, which lies `corner_m` from the middles of the streets.
pub(super) fn build_block(
    (corner, size): ([f64; 2], [f64; 2]),
    corner_m: f64,
    period_m: f64,
    ground: &dyn Relief,
    random: &Random,
    solids: &mut Vec<Solid>,
) {
    let plots = |length_m: f64| {
        let starts = periods(period_m, [corner_m, corner_m + length_m]);
        starts.map(|start_m| [HALF_GAP_M, period_m - HALF_GAP_M].map(|at| start_m - corner_m + at)).collect()
    };
    build_same_houses(corner, size, plots, ground, random, solids);
}

/// A piece of pavement, a tree, a pole and a parked car on both sides of each period of a street.
pub(super) fn furnish_street(
    stretch: &Stretch,
    period_m: f64,
    ground: &dyn Relief,
    random: &Random,
    solids: &mut Vec<Solid>,
) {
    let half_m = stretch.width_m / 2.0;
    let within = [stretch.clear_m[0], stretch.length_m - stretch.clear_m[1]];
    for start_m in periods(period_m, within) {
        for side in [1.0, -1.0] {
            let mut random = random.clone();
            let place =
                |share: f64, side_m: f64| stretch.place(start_m + share * period_m, side * side_m, ground);
            let up = Vector3::z() * KERB_M;
            let pavement = Shape::upright(
                stretch.place(start_m, side * (half_m - PAVEMENT_M), ground) - Vector3::z(),
                stretch.place(start_m + period_m - DROPPED_M, side * half_m, ground) + up,
            );
            solids.push(Solid {
                shape: pavement,
                reflectivity: GROUND_REFLECTIVITY,
                surface: Surface::Ground,
            });
            plant_tree(place(random.between(0.15, 0.3), half_m - 0.9), &mut random, solids);
            let (height_m, radius_m) = (random.between(3.0, 7.0), random.between(0.05, 0.12));
            put_pole(place(random.between(0.6, 0.85), half_m - 0.7), height_m, radius_m, solids);
            let middle = place(random.between(0.4, 0.6), half_m - 2.0);
            let yaw_rad = FRAC_PI_2 * stretch.axis as f64;
            solids.extend(car(middle, yaw_rad, random.between(0.08, 0.6), Surface::ParkedCar));
        }
    }
}

#[cfg(test)]
mod tests;
