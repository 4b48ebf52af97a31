use dmp_map::TileId;

/// A ray's way through the columns of tiles, nearest first (Amanatides & Woo 1987, in two dimensions).
#[derive(Debug, Clone, Copy)]
pub(crate) struct Walk {
    pub(crate) tile: TileId,
    /// Range at which the ray enters the tile, metres.
    pub(crate) enter_m: f64,
    /// Tiles passed since the first: the same for all rays that reach a tile from one first tile.
    pub(crate) steps: u32,
    /// Range of the next border across x and across y.
    next_m: [f64; 2],
    /// Range between borders across x and across y.
    stride_m: [f64; 2],
    step: [i32; 2],
}

impl Walk {
    /// Starts at the ray's origin. Coordinates and edge in metres; the direction is a unit vector.
    pub(crate) fn new(origin_in_world_m: [f64; 3], direction_in_world: [f64; 3], tile_edge_m: f64) -> Self {
        let cell: [f64; 2] = std::array::from_fn(|k| (origin_in_world_m[k] / tile_edge_m).floor());
        let mut walk = Self {
            tile: TileId { x: cell[0] as i32, y: cell[1] as i32 },
            enter_m: 0.0,
            steps: 0,
            next_m: [f64::INFINITY; 2],
            stride_m: [f64::INFINITY; 2],
            step: [0; 2],
        };
        for k in 0..2 {
            let d = direction_in_world[k];
            if d != 0.0 {
                let border = (cell[k] + f64::from(d > 0.0)) * tile_edge_m;
                walk.next_m[k] = (border - origin_in_world_m[k]) / d;
                walk.stride_m[k] = tile_edge_m / d.abs();
                walk.step[k] = if d > 0.0 { 1 } else { -1 };
            }
        }
        walk
    }

    /// Range at which the ray leaves the tile, metres; infinite for a vertical ray.
    #[inline]
    pub(crate) fn leave_m(&self) -> f64 {
        self.next_m[0].min(self.next_m[1])
    }

    /// Goes on to the next tile.
    #[inline]
    pub(crate) fn advance(&mut self) {
        let k = usize::from(self.next_m[1] < self.next_m[0]);
        self.enter_m = self.next_m[k];
        self.next_m[k] += self.stride_m[k];
        // Saturates: a ray never comes that far, its horizon ends it.
        match k {
            0 => self.tile.x = self.tile.x.saturating_add(self.step[0]),
            _ => self.tile.y = self.tile.y.saturating_add(self.step[1]),
        }
        self.steps += 1;
    }

    /// Whether the ray moves away from all tiles between `low` and `high`, or never moves at all.
    #[inline]
    pub(crate) fn leaves(&self, [low, high]: [TileId; 2]) -> bool {
        let gone =
            |at: i32, step: i32, low: i32, high: i32| (at < low && step <= 0) || (at > high && step >= 0);
        gone(self.tile.x, self.step[0], low.x, high.x) || gone(self.tile.y, self.step[1], low.y, high.y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn every_point_of_the_ray_lies_in_the_tile_of_its_range(
            x in -500.0..500.0_f64, y in -500.0..500.0_f64, heading in 0.0..6.3_f64, up in -1.5..1.5_f64,
        ) {
            let d = [heading.cos() * up.cos(), heading.sin() * up.cos(), up.sin()];
            let mut walk = Walk::new([x, y, 0.0], d, 32.0);
            for expected_steps in 0..20 {
                let (enter, leave) = (walk.enter_m, walk.leave_m());
                prop_assert!(enter <= leave + 1e-9);
                let middle = 0.5 * (enter + leave.min(enter + 1e4));
                for (tile, c) in [(walk.tile.x, x + d[0] * middle), (walk.tile.y, y + d[1] * middle)] {
                    prop_assert!(f64::from(tile) * 32.0 <= c + 1e-6 && c <= f64::from(tile + 1) * 32.0 + 1e-6);
                }
                prop_assert_eq!(walk.steps, expected_steps);
                walk.advance();
                prop_assert_eq!(walk.enter_m, leave);
            }
        }
    }

    #[test]
    fn rays_along_an_axis_and_straight_up_are_no_special_case() {
        let mut along = Walk::new([1.0, 1.0, 0.0], [-1.0, 0.0, 0.0], 32.0);
        assert_eq!(along.leave_m(), 1.0);
        along.advance();
        assert_eq!((along.tile, along.leave_m()), (TileId { x: -1, y: 0 }, 33.0));
        assert!(along.leaves([TileId { x: 0, y: 0 }, TileId { x: 5, y: 5 }]));
        let up = Walk::new([1.0, 1.0, 0.0], [0.0, 0.0, 1.0], 32.0);
        assert_eq!(up.leave_m(), f64::INFINITY);
    }
}
