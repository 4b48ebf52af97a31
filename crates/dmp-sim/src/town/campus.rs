//! A campus on foot: halls with narrow passages between them, an arcade, two terraces one above the other,
//! and the flights of stairs that lead up and down. Apart from them it is paved and level.
//!
//! The plan is always the same, and so is the walk through it; the seed makes façades, widths of passages,
//! trees and furniture.

use nalgebra::Vector3;

use super::ground::Ground;
use crate::parts::building::{Area, build_hall};
use crate::parts::shape::Shape;
use crate::parts::solid::{Solid, Surface};
use crate::parts::street::{plant_tree, put_pole};
use crate::random::Random;

/// Corners of the walk, metres east and north: from the south through a passage, under the arcade, round the
/// terraces by two alleys; over both terraces, down to the plaza, over both again, and home.
pub(crate) const WALK: [[f64; 2]; 20] = [
    [14.0, -3.0],
    [29.0, -3.0],
    [29.0, 12.6],
    [53.0, 12.6],
    [53.0, 45.0],
    [12.0, 45.0],
    [12.0, 28.0],
    [41.0, 28.0],
    [41.0, 40.0],
    [34.0, 40.0],
    [34.0, 17.0],
    [12.0, 17.0],
    [12.0, 28.0],
    [41.0, 28.0],
    [41.0, 40.0],
    [34.0, 40.0],
    [34.0, 17.0],
    [6.0, 17.0],
    [6.0, -3.0],
    [14.0, -3.0],
];

/// Heights of the terraces, metres.
const LOWER_M: f64 = 2.4;
const UPPER_M: f64 = 4.0;

/// The lower terrace and, on it, the upper one.
const TERRACES: [(Area, f64); 2] =
    [([[20.0, 52.0], [24.0, 44.0]], LOWER_M), ([[30.0, 52.0], [36.0, 44.0]], UPPER_M)];

/// A straight flight of stairs.
struct Flight {
    area: Area,
    /// It rises to the east (0) or to the north (1).
    axis: usize,
    heights_m: [f64; 2],
    /// One tread fewer lies between them: the last riser ends on the terrace.
    risers: usize,
}

const FLIGHTS: [Flight; 4] = [
    Flight { area: [[15.5, 20.0], [26.0, 30.0]], axis: 0, heights_m: [0.0, LOWER_M], risers: 15 },
    Flight { area: [[32.0, 36.0], [19.5, 24.0]], axis: 1, heights_m: [0.0, LOWER_M], risers: 15 },
    Flight { area: [[39.0, 43.0], [33.0, 36.0]], axis: 1, heights_m: [LOWER_M, UPPER_M], risers: 10 },
    Flight { area: [[32.0, 36.0], [33.0, 36.0]], axis: 1, heights_m: [LOWER_M, UPPER_M], risers: 10 },
];

/// Walls along the edges of the terraces, open where the stairs arrive: area and height of the floor.
const PARAPETS: [(Area, f64); 13] = [
    ([[20.0, 20.2], [24.0, 26.0]], LOWER_M),
    ([[20.0, 20.2], [30.0, 44.0]], LOWER_M),
    ([[20.0, 32.0], [24.0, 24.2]], LOWER_M),
    ([[36.0, 52.0], [24.0, 24.2]], LOWER_M),
    ([[20.0, 30.0], [43.8, 44.0]], LOWER_M),
    ([[51.8, 52.0], [24.0, 36.0]], LOWER_M),
    ([[30.0, 30.2], [36.0, 44.0]], UPPER_M),
    ([[30.0, 32.0], [36.0, 36.2]], UPPER_M),
    ([[36.0, 39.0], [36.0, 36.2]], UPPER_M),
    ([[43.0, 52.0], [36.0, 36.2]], UPPER_M),
    ([[30.0, 52.0], [43.8, 44.0]], UPPER_M),
    ([[51.8, 52.0], [36.0, 44.0]], UPPER_M),
    // A seat along the plaza.
    ([[22.0, 30.0], [21.4, 21.9]], -0.45),
];

/// Where trees stand, east, north and height of the floor, metres.
const TREES: [[f64; 3]; 16] = [
    [10.0, -6.2, 0.0],
    [18.0, -6.2, 0.0],
    [24.5, -6.2, 0.0],
    [36.0, -6.2, 0.0],
    [44.0, -6.2, 0.0],
    [52.0, -6.2, 0.0],
    [4.0, 4.0, 0.0],
    [4.0, 24.0, 0.0],
    [7.0, 30.0, 0.0],
    [4.5, 37.0, 0.0],
    [16.0, 36.0, 0.0],
    [20.0, 14.0, 0.0],
    [42.0, 20.5, 0.0],
    [25.0, 39.0, LOWER_M],
    [47.5, 30.0, LOWER_M],
    [48.0, 40.5, UPPER_M],
];

/// Height of what one walks on: the paving at 0, a terrace, or stairs, taken as a slope through their noses
/// and treads.
pub(crate) fn walkable_m(x: f64, y: f64) -> f64 {
    let within =
        |area: &Area| (area[0][0]..=area[0][1]).contains(&x) && (area[1][0]..=area[1][1]).contains(&y);
    let terraces = TERRACES.iter().filter(|(area, _)| within(area)).map(|(_, height_m)| *height_m);
    let flights = FLIGHTS.iter().filter(|flight| within(&flight.area)).map(|flight| {
        let [from, to] = flight.area[flight.axis];
        let [low_m, high_m] = flight.heights_m;
        low_m + (high_m - low_m) * ([x, y][flight.axis] - from) / (to - from)
    });
    terraces.chain(flights).fold(0.0, f64::max)
}

/// Everything that stands on the campus.
pub(super) fn build(seed: u64, ground: &Ground) -> Vec<Solid> {
    let mut random = Random::new(seed, &[b'c'.into()]);
    let mut solids = Vec::new();
    for (area, height_m) in TERRACES {
        solids.push(block(area, [-0.5, height_m], 0.3, Surface::Stairs));
    }
    for flight in &FLIGHTS {
        build_flight(flight, &mut solids);
    }
    for (area, floor_m) in PARAPETS {
        solids.push(block(area, [floor_m.max(0.0) - 0.5, floor_m + 0.9], 0.45, Surface::Stairs));
    }
    build_halls(ground, &mut random, &mut solids);
    for [x, y, floor_m] in TREES {
        let mut near = |at: f64| at + random.between(-0.4, 0.4);
        let foot = Vector3::new(near(x), near(y), floor_m);
        plant_tree(foot, &mut random, &mut solids);
    }
    furnish(&mut random, &mut solids);
    solids
}

fn block([east, north]: Area, [low_m, high_m]: [f64; 2], reflectivity: f64, surface: Surface) -> Solid {
    let corner = |k: usize, z: f64| Vector3::new(east[k], north[k], z);
    Solid { shape: Shape::upright(corner(0, low_m), corner(1, high_m)), reflectivity, surface }
}

fn build_flight(flight: &Flight, solids: &mut Vec<Solid>) {
    let [from, to] = flight.area[flight.axis];
    let [low_m, high_m] = flight.heights_m;
    let across = flight.area[1 - flight.axis];
    let treads = flight.risers - 1;
    for tread in 0..treads {
        let along = [tread, tread + 1].map(|k| from + (to - from) * k as f64 / treads as f64);
        let top_m = low_m + (high_m - low_m) * (tread + 1) as f64 / flight.risers as f64;
        // The tread, and beside it the walls that carry the rail, which rise with it.
        for (side, above_m) in
            [(across, 0.0), ([across[0] - 0.25, across[0]], 0.8), ([across[1], across[1] + 0.25], 0.8)]
        {
            let mut area = [side; 2];
            area[flight.axis] = along;
            solids.push(block(area, [low_m - 0.5, top_m + above_m], 0.4, Surface::Stairs));
        }
    }
}

/// The halls round the walk. What the random widths leave of the passages is 1.6 to 2.4 m.
fn build_halls(ground: &Ground, random: &mut Random, solids: &mut Vec<Solid>) {
    let passage_m = random.between(1.6, 2.4);
    let alley_m = random.between(1.6, 2.4);
    let north_m = random.between(1.6, 2.4);
    let (west_of, east_of) = (29.0 - passage_m / 2.0, 29.0 + passage_m / 2.0);
    let halls: [Area; 6] = [
        [[10.0, west_of], [1.0, 11.0]],
        [[east_of, 50.0], [1.0, 11.0]],
        [[52.0 + alley_m, 66.0], [-5.0, 44.0 + north_m]],
        [[4.0, 66.0], [44.0 + north_m, 58.0]],
        [[-8.0, 2.0], [-5.0, 44.0]],
        [[0.0, 66.0], [-18.0, -8.0]],
    ];
    for hall in halls {
        let top_m = random.between(6.5, 13.0);
        build_hall(hall, top_m, ground, random, solids);
    }
    // The arcade before the second hall: columns, and a floor that rests on them.
    let mut x = east_of + 0.3;
    let pitch_m = random.between(2.6, 3.4);
    while x < 50.0 {
        let shape = Shape::Cylinder { foot: Vector3::new(x, 14.3, -0.5), radius_m: 0.22, height_m: 3.7 };
        solids.push(Solid { shape, reflectivity: 0.5, surface: Surface::Building });
        solids.push(block([[x - 0.15, x + 0.15], [11.0, 14.3]], [2.9, 3.2], 0.5, Surface::Building));
        x += pitch_m;
    }
    solids.push(block([[east_of, 50.0], [11.0, 14.6]], [3.2, 6.2], 0.5, Surface::Building));
}

/// Benches, bins, lamps and bicycle stands beside the walk, on the paving and on the terraces.
fn furnish(random: &mut Random, solids: &mut Vec<Solid>) {
    for [x, y, floor_m] in
        [[17.0, 20.5, 0.0], [38.0, 15.8, 0.0], [8.0, 39.5, 0.0], [24.0, 33.0, LOWER_M], [44.0, 26.0, LOWER_M]]
    {
        let along = x + random.between(-1.0, 1.0);
        let seat = [[along - 0.9, along + 0.9], [y, y + 0.45]];
        solids.push(block(seat, [floor_m + 0.38, floor_m + 0.45], 0.35, Surface::Stairs));
        let back = [seat[0], [y + 0.4, y + 0.45]];
        solids.push(block(back, [floor_m + 0.45, floor_m + 0.9], 0.35, Surface::Stairs));
    }
    for [x, y, floor_m] in [
        [31.5, -4.6, 0.0],
        [9.0, 14.5, 0.0],
        [9.5, 22.5, 0.0],
        [17.5, 42.0, 0.0],
        [45.0, 16.6, 0.0],
        [30.5, 26.5, LOWER_M],
        [37.5, 42.0, UPPER_M],
    ] {
        let foot = Vector3::new(x + random.between(-0.3, 0.3), y, floor_m);
        put_pole(foot, random.between(3.0, 5.0), random.between(0.05, 0.09), solids);
        put_pole(foot + Vector3::x() * 0.6, 0.9, 0.22, solids);
    }
    let stand_m = random.between(0.7, 0.9);
    for k in 0..9 {
        let foot = Vector3::new(13.0 + stand_m * f64::from(k), 13.0, 0.0);
        put_pole(foot, 0.85, 0.03, solids);
    }
}

#[cfg(test)]
mod tests;
