//! A straight tunnel: floor, two walls and a ceiling of one cross-section, and nothing else. Nothing holds a place along
//! it, and nothing holds a turn about it but its corners.

use nalgebra::Vector3;

use super::options::TownOptions;
use crate::error::{SimError, require};
use crate::parts::shape::Shape;
use crate::parts::solid::{Solid, Surface};

/// From the floor to the ceiling, metres.
pub(super) const HEIGHT_M: f64 = 6.0;
/// Length beyond the streets' ends, metres: farther than any ray, so that no scan sees an end.
const BEYOND_M: f64 = 1200.0;
/// Of walls and ceiling, metres.
const THICK_M: f64 = 1.0;

/// Refuses what a tunnel cannot have.
pub(super) fn check(options: &TownOptions) -> Result<(), SimError> {
    let TownOptions { blocks, relief_m, moving_cars, .. } = *options;
    require(blocks[1] >= 2, "the number of blocks beside a tunnel", "2 or more", blocks[1] as f64)?;
    require(relief_m == 0.0, "the relief of a tunnel in m", "0", relief_m)?;
    require(moving_cars == 0, "the number of cars that drive through a tunnel", "0", moving_cars as f64)
}

/// Walls and ceiling over the first inner street from west to east, which a straight drive takes.
pub(super) fn build(options: &TownOptions) -> Vec<Solid> {
    let TownOptions { blocks, block_m, street_m, .. } = *options;
    let east_m = [-BEYOND_M, blocks[0] as f64 * block_m[0] + BEYOND_M];
    let [south_m, north_m] = [-1.0, 1.0].map(|side| block_m[1] + side * street_m / 2.0);
    let put = |north_m: [f64; 2], up_m: [f64; 2]| {
        let corner = |k: usize| Vector3::new(east_m[k], north_m[k], up_m[k]);
        Solid { shape: Shape::upright(corner(0), corner(1)), reflectivity: 0.4, surface: Surface::Building }
    };
    let wall_m = [-THICK_M, HEIGHT_M];
    vec![
        put([south_m - THICK_M, south_m], wall_m),
        put([north_m, north_m + THICK_M], wall_m),
        put([south_m - THICK_M, north_m + THICK_M], [HEIGHT_M, HEIGHT_M + THICK_M]),
    ]
}

#[cfg(test)]
mod tests;
