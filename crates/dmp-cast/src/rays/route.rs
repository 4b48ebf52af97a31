//! Routes rays through the columns of tiles, nearest first (Amanatides & Woo 1987, in two dimensions).

use dmp_map::{Independence, TileExtent, TileId};

use super::{BORDER_SLACK_M, Rays};
use crate::within::RAYS;

impl Rays {
    /// The current tile of a ray.
    #[inline(always)]
    fn tile(&self, lane: usize) -> TileId {
        TileId { x: self.tile[0][lane], y: self.tile[1][lane] }
    }

    /// Range at which a ray leaves its tile; infinite for a vertical one.
    #[inline(always)]
    pub(super) fn leave_m(&self, lane: usize) -> f64 {
        let [x, y] = [self.next_m[0][lane], self.next_m[1][lane]];
        if x < y { x } else { y }
    }

    /// Advances to the next tile.
    #[inline(always)]
    fn advance(&mut self, lane: usize, tile_edge_m: f64) {
        let k = usize::from(self.next_m[1][lane] < self.next_m[0][lane]);
        let d = self.direction_in_world[k][lane];
        self.enter_m[lane] = self.next_m[k][lane];
        self.next_m[k][lane] += tile_edge_m / d.abs();
        // Saturates, but is never reached: a ray begins inside the world and leaves the map before.
        self.tile[k][lane] = self.tile[k][lane].saturating_add(if d > 0.0 { 1 } else { -1 });
        self.steps[lane] += 1;
    }

    /// Whether a ray has passed all tiles between `low` and `high`, or never reaches them.
    #[inline(always)]
    fn leaves(&self, lane: usize, [low, high]: [TileId; 2]) -> bool {
        let gone = |k: usize, low: i32, high: i32| {
            let (at, d) = (self.tile[k][lane], self.direction_in_world[k][lane]);
            (at < low && d <= 0.0) || (at > high && d >= 0.0)
        };
        gone(0, low.x, high.x) || gone(1, low.y, high.y)
    }

    /// Moves each ray to the next tile that may change its answer, and passes `go` those tiles with their rays, given
    /// as bits. Rays without such a tile end.
    #[inline(always)]
    pub(crate) fn route(
        &mut self,
        mut lanes: u32,
        tile_edge_m: f64,
        bounds: [TileId; 2],
        mut extent_of: impl FnMut(TileId) -> Option<TileExtent>,
        mut go: impl FnMut(TileId, usize, u32),
    ) {
        while lanes != 0 {
            // Usually all rays are in one tile.
            let lane = lanes.trailing_zeros() as usize % RAYS;
            let (tile, steps) = (self.tile(lane), self.steps[lane]);
            let mut here = 0;
            for lane in 0..RAYS {
                let is = (self.tile[0][lane] == tile.x) & (self.tile[1][lane] == tile.y);
                here |= u32::from(is & (self.steps[lane] == steps)) << lane;
            }
            here &= lanes;
            lanes &= !here;
            let extent = extent_of(tile);
            let (goes, ends) = extent.map_or((0, self.ended()), |extent| self.may_gain(&extent));
            if here & goes != 0 {
                go(tile, steps as usize, here & goes);
            }
            for lane in set_bits(here & !goes & !ends) {
                if extent.is_some() || !self.leaves(lane, bounds) {
                    self.advance(lane, tile_edge_m);
                    lanes |= 1 << lane;
                }
            }
        }
    }

    /// Rays that end before their tile, or never leave it.
    #[inline(always)]
    fn ended(&self) -> u32 {
        let mut ended = 0;
        for lane in 0..RAYS {
            let out = (self.enter_m[lane] > self.end_m[lane]) | (self.leave_m(lane) == f64::INFINITY);
            ended |= u32::from(out) << lane;
        }
        ended
    }

    /// Rays for which a tile with this extent may still change an answer, by its distance, its heights and its
    /// segments; and rays that end there.
    #[inline(always)]
    fn may_gain(&self, extent: &TileExtent) -> (u32, u32) {
        let may_hold = |independence: Option<Independence>| {
            independence.is_some_and(|i| i.holds(extent.min_third_lowest, extent.max_third_highest))
        };
        let has_independent = may_hold(self.asked.independence);
        let has_revisited = may_hold(self.asked.revisit);
        let [low_m, high_m] = extent.z_range_m;
        let mut goes = 0;
        for lane in 0..RAYS {
            let enter_m = self.enter_m[lane];
            let (leave_m, end_m) = (self.leave_m(lane), self.end_m[lane]);
            let (o, d) = (self.origin_in_world_m[2][lane], self.direction_in_world[2][lane]);
            let at_heights = reaches_heights(
                o,
                d,
                [low_m, high_m],
                enter_m,
                if leave_m < end_m { leave_m } else { end_m },
            );
            let from_m = enter_m - BORDER_SLACK_M;
            let gains = (from_m < self.first_m[lane])
                | (from_m <= self.measured_m[lane] + self.gap_m[lane])
                | (has_independent & (from_m < self.independent_m[lane]))
                | (has_revisited
                    & (self.revisited >> lane & 1 == 0)
                    & (from_m <= self.measured_m[lane] + self.return_m));
            goes |= u32::from(at_heights & gains & (enter_m <= end_m)) << lane;
        }
        (goes, self.ended())
    }

    /// Moves rays out of their tile.
    #[inline(always)]
    pub(crate) fn leave_tile(&mut self, lanes: u32, tile_edge_m: f64) {
        set_bits(lanes).for_each(|lane| self.advance(lane % RAYS, tile_edge_m));
    }

    /// Rays whose answers may still change beyond their tile.
    #[inline(always)]
    pub(crate) fn unsettled(&self) -> u32 {
        let [no_independence, no_revisit] =
            [self.asked.independence, self.asked.revisit].map(|asked| asked.is_none());
        let mut lanes = 0;
        for lane in 0..RAYS {
            let leave_m = self.leave_m(lane);
            let settled = (self.first_m[lane] <= leave_m)
                & (self.measured_m[lane] + self.gap_m[lane] <= leave_m)
                & (no_independence | (self.independent_m[lane] <= leave_m))
                & (no_revisit
                    | (self.revisited >> lane & 1 == 1)
                    | (self.measured_m[lane] + self.return_m <= leave_m));
            lanes |= u32::from(!settled & (leave_m < f64::INFINITY)) << lane;
        }
        lanes
    }
}

/// The positions of the set bits.
#[inline(always)]
pub(super) fn set_bits(mut bits: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let bit = bits.trailing_zeros() as usize;
        bits &= bits.wrapping_sub(1);
        (bit < 32).then_some(bit)
    })
}

/// Whether a ray may meet a disc between two heights within a range interval.
#[inline(always)]
fn reaches_heights(
    origin_z_m: f64,
    direction_z: f64,
    [low_m, high_m]: [f64; 2],
    enter_m: f64,
    leave_m: f64,
) -> bool {
    // A metre before and behind: discs reach a little over the tile's border.
    let z_at = |range_m: f64| origin_z_m + direction_z * range_m;
    let (a, b) = (z_at(enter_m - 1.0), z_at(leave_m + 1.0));
    // Without `max` and `min`, whose NaN rules prevent vectorisation.
    ((a >= low_m) | (b >= low_m)) & ((a <= high_m) | (b <= high_m))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::query::{CastSettings, Query};
    use dmp_sensor::Ray;
    use proptest::prelude::*;

    const EDGE_M: f64 = 32.0;

    fn ray(x: f64, y: f64, direction_in_world: [f64; 3]) -> Rays {
        let query = Query {
            ray: Ray { origin_in_world: [x, y, 0.0], direction_in_world, range_m: 1e3 },
            segment: None,
        };
        let mut rays = Rays::EMPTY;
        rays.fill(&[query], &[0], &CastSettings::default(), EDGE_M);
        rays
    }

    proptest! {
        #[test]
        fn every_point_of_the_ray_lies_in_the_tile_of_its_range(
            x in -500.0..500.0_f64, y in -500.0..500.0_f64, heading in 0.0..6.3_f64, up in -1.5..1.5_f64,
        ) {
            let d = [heading.cos() * up.cos(), heading.sin() * up.cos(), up.sin()];
            let mut rays = ray(x, y, d);
            for expected_steps in 0..20 {
                let (enter, leave) = (rays.enter_m[0], rays.leave_m(0));
                prop_assert!(enter <= leave + 1e-9);
                let (tile, middle) = (rays.tile(0), 0.5 * (enter + leave.min(enter + 1e4)));
                for (tile, c) in [(tile.x, x + d[0] * middle), (tile.y, y + d[1] * middle)] {
                    prop_assert!(f64::from(tile) * EDGE_M <= c + 1e-6 && c <= f64::from(tile + 1) * EDGE_M + 1e-6);
                }
                prop_assert_eq!(rays.steps[0], expected_steps);
                rays.leave_tile(1, EDGE_M);
                prop_assert_eq!(rays.enter_m[0], leave);
            }
        }
    }

    #[test]
    fn rays_along_an_axis_and_straight_up_are_no_special_case() {
        let mut along = ray(1.0, 1.0, [-1.0, 0.0, 0.0]);
        assert_eq!(along.leave_m(0), 1.0);
        along.leave_tile(1, EDGE_M);
        assert_eq!((along.tile(0), along.leave_m(0)), (TileId { x: -1, y: 0 }, 33.0));
        assert!(along.leaves(0, [TileId { x: 0, y: 0 }, TileId { x: 5, y: 5 }]));
        assert_eq!(ray(1.0, 1.0, [0.0, 0.0, 1.0]).leave_m(0), f64::INFINITY);
    }
}
