//! A town of streets, or a campus: made as a whole, of any shape that a ray can meet in closed form.

mod alike;
mod campus;
mod grid;
mod ground;
mod options;
mod traffic;
mod tunnel;

use nalgebra::Vector3;

use crate::error::{SimError, require};
use crate::parts::building::{Storeys, build_block};
use crate::parts::relief::Relief as _;
use crate::parts::solid::{GROUND_REFLECTIVITY, Hit, Solid, Surface};
use crate::parts::street::{CROSSING_M, Stretch, furnish_street};
use crate::random::Random;
use crate::route::Route;
pub(crate) use campus::{WALK, walkable_m};
use grid::Grid;
use ground::Ground;
pub use options::{Scenery, TownOptions};
use traffic::MovingCar;

/// A block takes about 30 kB of memory.
const MOST_BLOCKS: usize = 20_000;

/// The houses of a town.
const HOUSES: Storeys = Storeys { least: 2, choices: 3 };

/// A town on gentle hills: blocks of houses with relief in their façades, trees, poles, parked and
/// moving cars. It lies in the world frame, x east, y north, z up, its south-western crossing at (0, 0).
#[derive(Debug, Clone)]
pub struct Town {
    options: TownOptions,
    ground: Ground,
    solids: Vec<Solid>,
    grid: Grid,
    cars: Vec<MovingCar>,
}

impl Town {
    /// Builds the town: the same options give the same town, to the bit.
    ///
    /// # Errors
    /// When there is no block, or one that is too small to build on.
    pub fn new(options: TownOptions) -> Result<Self, SimError> {
        let TownOptions { seed, blocks, block_m, street_m, .. } = options;
        let smallest = block_m[0].min(block_m[1]) - street_m;
        require(blocks[0].min(blocks[1]) >= 1, "the number of blocks", "1 or more each way", 0.0)?;
        let count = blocks[0].saturating_mul(blocks[1]);
        require(
            count <= MOST_BLOCKS,
            "the number of blocks",
            "20000 or fewer (a one-way drive needs the fewest)",
            count as f64,
        )?;
        require(street_m >= 10.0, "the width of the streets in m", "10 or more", street_m)?;
        require(smallest >= 10.0, "the depth of a block without its streets in m", "10 or more", smallest)?;
        let relief = (0.0..=20.0).contains(&options.relief_m);
        require(relief, "the relief in m", "from 0 to 20", options.relief_m)?;
        match options.scenery {
            Scenery::Varied => {}
            Scenery::Alike { period_m } => alike::check(period_m, block_m, options.relief_m)?,
            Scenery::Tunnel => tunnel::check(&options)?,
        }
        let ground = Ground::new(options.relief_m, seed);
        let solids = build(&options, &ground);
        let grid = Grid::new(solids.iter().map(|solid| &solid.shape));
        let cars = (0..options.moving_cars).map(|car| MovingCar::new(car, &options)).collect();
        Ok(Self { options, ground, solids, grid, cars })
    }

    /// Builds a campus instead: halls with narrow passages between them, an arcade, two terraces and the
    /// stairs between them, on level paving. It has no blocks and no traffic; its one walk is
    /// [`Route::Campus`](crate::Route::Campus).
    pub fn campus(seed: u64) -> Self {
        let options =
            TownOptions { seed, blocks: [0, 0], relief_m: 0.0, moving_cars: 0, ..TownOptions::default() };
        let ground = Ground::new(0.0, seed);
        let solids = campus::build(seed, &ground);
        let grid = Grid::new(solids.iter().map(|solid| &solid.shape));
        Self { options, ground, solids, grid, cars: Vec::new() }
    }

    /// The numbers it was built from; of a campus only the seed is used.
    pub fn options(&self) -> &TownOptions {
        &self.options
    }

    /// Whether a route leads through such a place: a campus is walked over, a tunnel driven straight.
    pub(crate) fn has(&self, route: Route) -> bool {
        let is_campus = self.options.blocks == [0, 0];
        let other = self.options.scenery == Scenery::Tunnel && route != Route::Straight;
        is_campus == (route == Route::Campus) && !other
    }

    /// Height of the ground at a place, metres.
    pub fn ground_m(&self, x: f64, y: f64) -> f64 {
        self.ground.height_m(x, y)
    }

    /// Slope of the ground at a place: ∂z/∂x and ∂z/∂y.
    pub(crate) fn slope(&self, x: f64, y: f64) -> [f64; 2] {
        self.ground.at(x, y).1.into()
    }

    /// Number of solids it is built of.
    pub fn solids(&self) -> usize {
        self.solids.len()
    }

    /// The first surface from `origin` along the unit vector `direction`, at `time_s`
    /// (moving cars are elsewhere at another time). `None` where the ray leaves the town, after 1 km.
    ///
    /// A solid that the origin lies in is not seen, and a moving car that would run into the origin
    /// is excluded: traffic keeps its distance.
    pub fn cast(&self, origin: Vector3<f64>, direction: Vector3<f64>, time_s: f64) -> Option<Hit> {
        let mut far_m = 1000.0;
        let mut hit = None;
        let mut keep = |solid: &Solid, far_m: &mut f64| {
            if let Some(entry) = solid.shape.entry(origin, direction).filter(|entry| entry.range_m < *far_m) {
                *far_m = entry.range_m;
                hit = Some((entry, solid.reflectivity, solid.surface));
            }
        };
        self.grid.walk(origin, direction, far_m, |items, far| {
            for &item in items {
                keep(&self.solids[item as usize], far);
            }
            far_m = *far;
        });
        for car in &self.cars {
            for solid in car.solids_near_ray(origin, direction, far_m, time_s, &self.ground).iter().flatten()
            {
                keep(solid, &mut far_m);
            }
        }
        if let Some(entry) = self.ground.entry(origin, direction, far_m) {
            hit = Some((entry, GROUND_REFLECTIVITY, Surface::Ground));
        }
        hit.map(|(entry, reflectivity, surface)| Hit::of(&entry, direction, reflectivity, surface))
    }
}

/// Everything that stands in the town.
fn build(options: &TownOptions, ground: &Ground) -> Vec<Solid> {
    let TownOptions { seed, blocks, block_m, street_m, scenery, .. } = *options;
    let period_m = match scenery {
        Scenery::Varied => None,
        Scenery::Alike { period_m } => Some(period_m),
        Scenery::Tunnel => return tunnel::build(options),
    };
    // Of what is alike, there is one.
    let same = Random::new(seed, &[b'a'.into()]);
    let mut solids = Vec::new();
    for j in 0..blocks[1] {
        for i in 0..blocks[0] {
            let mut random = Random::new(seed, &[b'b'.into(), i as u64, j as u64]);
            let corner = [i as f64 * block_m[0] + street_m / 2.0, j as f64 * block_m[1] + street_m / 2.0];
            let size = block_m.map(|pitch| pitch - street_m);
            if let Some(period_m) = period_m {
                let half_m = street_m / 2.0;
                alike::build_block((corner, size), half_m, period_m, ground, &same, &mut solids);
            } else {
                build_block(corner, size, HOUSES, ground, &mut random, &mut solids);
            }
        }
    }
    for j in 0..=blocks[1] {
        for i in 0..=blocks[0] {
            for axis in 0..2 {
                if [i, j][axis] < blocks[axis] {
                    let mut random = Random::new(seed, &[b's'.into(), i as u64, j as u64, axis as u64]);
                    let stretch = Stretch {
                        start: [i as f64 * block_m[0], j as f64 * block_m[1]],
                        axis,
                        length_m: block_m[axis],
                        width_m: street_m,
                        clear_m: [CROSSING_M; 2],
                        corner_m: street_m / 2.0,
                        parked: options.parked,
                    };
                    if let Some(period_m) = period_m {
                        alike::furnish_street(&stretch, period_m, ground, &same, &mut solids);
                    } else {
                        furnish_street(&stretch, ground, &mut random, &mut solids);
                    }
                }
            }
        }
    }
    solids
}

#[cfg(test)]
mod tests {
    use super::*;

    fn level() -> Town {
        Town::new(TownOptions { relief_m: 0.0, ..TownOptions::default() }).unwrap()
    }

    #[test]
    fn straight_down_is_the_street() {
        let town = level();
        let hit = town.cast(Vector3::new(36.0, 28.0, 2.0), -Vector3::z(), 0.0).unwrap();
        assert_eq!((hit.range_m, hit.cos_incidence, hit.surface), (2.0, 1.0, Surface::Ground));
        assert_eq!(town.cast(Vector3::new(36.0, 28.0, 2.0), Vector3::z(), 0.0), None);
    }

    #[test]
    fn impossible_towns_are_refused() {
        for options in [
            TownOptions { blocks: [0, 3], ..TownOptions::default() },
            TownOptions { blocks: [200, 200], ..TownOptions::default() },
            TownOptions { street_m: 25.0, ..TownOptions::default() },
            TownOptions { relief_m: f64::NAN, ..TownOptions::default() },
        ] {
            assert!(matches!(Town::new(options), Err(SimError::OutOfRange { .. })));
        }
    }
}
