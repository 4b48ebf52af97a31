//! What a town is made from.

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
    /// Height of the hills from lowest to highest, about, metres.
    pub relief_m: f64,
    /// Share of the kerb that has cars parked on it.
    pub parked: f64,
    /// Cars that drive through the streets, each along one.
    pub moving_cars: usize,
    /// Seed of these; `None`: that of the town.
    pub traffic_seed: Option<u64>,
}

impl Default for TownOptions {
    fn default() -> Self {
        Self {
            seed: 1,
            blocks: [3, 3],
            block_m: [36.0, 28.0],
            street_m: 14.0,
            relief_m: 4.0,
            parked: 0.35,
            moving_cars: 0,
            traffic_seed: None,
        }
    }
}
