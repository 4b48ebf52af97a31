//! What a town is made from.

use super::alike;
use crate::error::SimError;

/// Blocks of houses that are alike are at least so long, east and north, metres: from the middle of such a street, its ends
/// are far.
const ALIKE_BLOCK_M: [f64; 2] = [144.0, 96.0];
/// From wall to wall of a tunnel, metres: wide enough to turn round in it.
const TUNNEL_M: f64 = 12.0;

/// What stands along the streets of a [`Town`](crate::Town).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Scenery {
    /// Houses, trees, poles and parked cars, no two alike.
    #[default]
    Varied,
    /// The same house, tree, pole, parked car and piece of pavement again every `period_m` on both sides of every street,
    /// identical in shape: a street that is shifted along itself by `period_m` is the same except at its ends. What a town
    /// would do to a registration that takes the first fit for the only one.
    Alike {
        /// From one house to the next, metres.
        period_m: f64,
    },
    /// None: a straight bare tunnel as wide as a street, of one cross-section, so long that no ray sees an end. No two places along it
    /// differ. [`Route::Straight`](crate::Route::Straight) alone leads through.
    Tunnel,
}

/// Of which size a [`Town`](crate::Town) is. Everything in it follows from these numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct TownOptions {
    /// Two towns of different seeds have nothing in common but their streets.
    pub seed: u64,
    /// Blocks from west to east and from south to north.
    pub blocks: [usize; 2],
    /// Distance between the middles of neighbouring streets, east and north, metres.
    pub block_m: [f64; 2],
    /// Width of the streets from façade to façade, metres.
    pub street_m: f64,
    /// What stands along the streets.
    pub scenery: Scenery,
    /// Height of the hills from lowest to highest, about, metres.
    pub relief_m: f64,
    /// Share of the kerb that has cars parked on it; where the scenery is alike, a car is parked in each period.
    pub parked: f64,
    /// Cars that drive through the streets, each along one.
    pub moving_cars: usize,
}

impl Default for TownOptions {
    fn default() -> Self {
        Self {
            seed: 1,
            blocks: [3, 3],
            block_m: [36.0, 28.0],
            street_m: 14.0,
            scenery: Scenery::Varied,
            relief_m: 4.0,
            parked: 0.35,
            moving_cars: 0,
        }
    }
}

impl TownOptions {
    /// The usual town where such scenery stands along the streets: what is alike stands on level ground, in blocks of
    /// whole periods; a tunnel is level and 12 m wide.
    ///
    /// # Errors
    /// When the period is outside its range.
    pub fn of(scenery: Scenery) -> Result<Self, SimError> {
        let usual = Self { scenery, ..Self::default() };
        Ok(match scenery {
            Scenery::Varied => usual,
            Scenery::Alike { period_m } => {
                Self { block_m: alike::blocks_m(period_m, ALIKE_BLOCK_M)?, relief_m: 0.0, ..usual }
            }
            Scenery::Tunnel => Self { street_m: TUNNEL_M, relief_m: 0.0, ..usual },
        })
    }
}
