//! Where drives go, and how large a town they need.

/// What is driven straight before the first crossing of an open route, metres.
pub(crate) const RUN_IN_M: f64 = 12.0;

/// Where a drive goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Route {
    /// Round a rectangle of blocks, again and again: about two thirds of the travel is one lap.
    #[default]
    Loop,
    /// Round a rectangle of blocks twice in the same lane: about half of the travel is one lap.
    TwoLaps,
    /// Round a large rectangle of blocks: a lap takes nearly all of the travel, so the drive meets its own
    /// way at the very end only.
    Ring,
    /// Half of the travel out, round one corner, then back in the opposite lane.
    OutAndBack,
    /// Half of the travel out along one street to a crossing, then back along the street in the opposite lane. A travel of
    /// less than two blocks does not come back.
    Straight,
    /// Up one street and down the next: no place is seen twice from the same street.
    OneWay,
    /// On foot over a [campus](crate::Town::campus): through passages and an arcade, up and down its stairs
    /// twice, and home after about 365 m; then again.
    Campus,
}

impl Route {
    /// The blocks a town needs for about `travel_m` of this route: one ring of blocks lies around it. A
    /// campus has none.
    pub fn blocks(self, travel_m: f64, block_m: [f64; 2]) -> [usize; 2] {
        if self == Self::Campus { [0, 0] } else { self.core(travel_m, block_m).map(|blocks| blocks + 2) }
    }

    /// The blocks within the ring.
    pub(crate) fn core(self, travel_m: f64, [east_m, north_m]: [f64; 2]) -> [usize; 2] {
        // A rectangle as square as can be.
        let round = |half_lap_m: f64| {
            let east = (half_lap_m / 2.0 / east_m).round().max(1.0);
            let north = ((half_lap_m - east * east_m) / north_m).round().max(1.0);
            [east as usize, north as usize]
        };
        match self {
            Self::Loop => round(travel_m / 3.0),
            Self::TwoLaps => round(travel_m / 4.0),
            Self::Ring => round((travel_m - RUN_IN_M) / 2.0),
            Self::Campus => [0, 0],
            Self::OutAndBack => {
                let leg_m = ((travel_m - 2.0 * RUN_IN_M) / 4.0).max(0.0);
                [east_m, north_m].map(|pitch| (leg_m / pitch).round().max(1.0) as usize)
            }
            Self::Straight => {
                let leg_m = (travel_m / 2.0 - RUN_IN_M).max(0.0);
                [(leg_m / east_m).round().max(1.0) as usize, 1]
            }
            Self::OneWay => {
                // As many legs of `east` blocks as streets: about a square.
                let east = libm::sqrt(travel_m / east_m * north_m / east_m).round().max(1.0);
                let legs = (travel_m / (east * east_m + north_m)).ceil().max(1.0);
                [east as usize, legs as usize]
            }
        }
    }
}
