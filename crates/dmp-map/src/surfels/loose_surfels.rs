//! A map in memory from surfels of any origin.

use std::collections::HashMap;

use dmp_disk::TileId;

use super::surfel::Surfel;
use super::tile::{Tile, TileExtent};
use super::tile_source::TileSource;
use crate::MapError;

/// A surfel in world coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WorldSurfel {
    /// Centre of the disc, world metres.
    pub centre_in_world_m: [f64; 3],
    /// Unit normal; its sign has no meaning.
    pub normal: [f32; 3],
    /// See [`crate::Support::third_lowest`].
    pub third_lowest: i32,
    /// See [`crate::Support::third_highest`].
    pub third_highest: i32,
}

/// Surfels of any origin, cut into tiles and held in memory: for maps that were not fused here.
#[derive(Debug)]
pub struct LooseSurfels {
    tile_edge_m: f64,
    radius_m: f64,
    tiles: HashMap<TileId, (TileExtent, Tile)>,
    bounds: Option<[TileId; 2]>,
}

impl LooseSurfels {
    /// Cuts surfels with discs of `radius_m` into tiles; a disc over a border is in every tile it reaches. `O(surfels)`
    /// time and memory.
    ///
    /// # Errors
    /// A radius or an edge that is not a positive number of metres, an edge below a disc's diameter or too small to
    /// number the tiles, a centre outside ±5e7 m, a normal that is not a unit vector.
    pub fn new(
        tile_edge_m: f64,
        radius_m: f64,
        surfels: impl IntoIterator<Item = WorldSurfel>,
    ) -> Result<Self, MapError> {
        for (what, metres) in [("radius of discs", radius_m), ("edge of tiles", tile_edge_m)] {
            if !(metres.is_finite() && metres > 0.0) {
                return Err(MapError::NoLength { what, metres });
            }
        }
        let least_m = (2.0 * radius_m).max(crate::grid::WORLD_LIMIT_M / f64::from(1 << 30));
        if tile_edge_m < least_m {
            return Err(MapError::NoLength {
                what: "edge of tiles for discs of this radius",
                metres: tile_edge_m,
            });
        }
        let mut own: HashMap<TileId, Vec<WorldSurfel>> = HashMap::new();
        let mut copies: HashMap<TileId, Vec<WorldSurfel>> = HashMap::new();
        for surfel in surfels {
            surfel.check()?;
            let [x, y, _] = surfel.centre_in_world_m;
            let home = [x, y].map(|c| (c / tile_edge_m).floor() as i32);
            let half = surfel.as_tile_surfel([0.0; 3]).half_extents_m(radius_m as f32);
            // A little more than the disc, so that rounding at the border loses nothing.
            let reach = |c: f64, half: f32| {
                let half = f64::from(half) + 1e-3;
                ((c - half) / tile_edge_m).floor() as i32..=((c + half) / tile_edge_m).floor() as i32
            };
            own.entry(TileId { x: home[0], y: home[1] }).or_default().push(surfel);
            for ty in reach(y, half[1]) {
                for tx in reach(x, half[0]).filter(|&tx| [tx, ty] != home) {
                    copies.entry(TileId { x: tx, y: ty }).or_default().push(surfel);
                }
            }
        }
        let mut map = Self { tile_edge_m, radius_m, tiles: HashMap::new(), bounds: None };
        for id in copies.keys().copied().collect::<Vec<_>>() {
            own.entry(id).or_default();
        }
        for (id, own) in own {
            map.insert(id, &own, copies.get(&id).map_or(&[], Vec::as_slice));
        }
        Ok(map)
    }

    fn insert(&mut self, id: TileId, own: &[WorldSurfel], copies: &[WorldSurfel]) {
        let middle = own.get(own.len() / 2).or_else(|| copies.first());
        let Some(base_z_m) = middle.map(|surfel| surfel.centre_in_world_m[2]) else { return };
        let origin_in_world_m =
            [f64::from(id.x) * self.tile_edge_m, f64::from(id.y) * self.tile_edge_m, base_z_m];
        let surfels: Vec<Surfel> =
            own.iter().chain(copies).map(|surfel| surfel.as_tile_surfel(origin_in_world_m)).collect();
        let mut extent = TileExtent::EMPTY;
        surfels.iter().for_each(|surfel| extent.add(surfel, base_z_m, self.radius_m as f32));
        let [low, high] = self.bounds.get_or_insert([id, id]);
        *low = TileId { x: low.x.min(id.x), y: low.y.min(id.y) };
        *high = TileId { x: high.x.max(id.x), y: high.y.max(id.y) };
        self.tiles.insert(id, (extent, Tile { id, origin_in_world_m, surfels, own: own.len() }));
    }

    /// All tiles, in no particular order.
    pub fn tiles(&self) -> impl Iterator<Item = &Tile> {
        self.tiles.values().map(|(_, tile)| tile)
    }
}

impl WorldSurfel {
    fn check(&self) -> Result<(), MapError> {
        let limit_m = crate::grid::WORLD_LIMIT_M;
        if !self.centre_in_world_m.iter().all(|c| c.abs() <= limit_m) {
            return Err(MapError::OutOfWorld { point_in_world_m: self.centre_in_world_m, limit_m });
        }
        let norm2: f32 = self.normal.iter().map(|n| n * n).sum();
        if (norm2 - 1.0).abs() > 1e-3 || norm2.is_nan() {
            return Err(MapError::NoNormal { normal: self.normal });
        }
        Ok(())
    }

    fn as_tile_surfel(&self, origin_in_world_m: [f64; 3]) -> Surfel {
        Surfel {
            centre_in_tile_m: std::array::from_fn(|k| {
                (self.centre_in_world_m[k] - origin_in_world_m[k]) as f32
            }),
            normal: self.normal,
            third_lowest: self.third_lowest,
            third_highest: self.third_highest,
        }
    }
}

impl TileSource for LooseSurfels {
    fn tile_edge_m(&self) -> f64 {
        self.tile_edge_m
    }

    fn disc_radius_m(&self) -> f64 {
        self.radius_m
    }

    fn tile_bounds(&self) -> Option<[TileId; 2]> {
        self.bounds
    }

    fn tile_extent(&self, tile: TileId) -> Option<TileExtent> {
        Some(self.tiles.get(&tile)?.0)
    }

    fn load_tile(&self, tile: TileId) -> Result<Option<Tile>, MapError> {
        Ok(self.tiles.get(&tile).map(|(_, tile)| tile.clone()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn surfel(centre_in_world_m: [f64; 3], normal: [f32; 3]) -> WorldSurfel {
        WorldSurfel { centre_in_world_m, normal, third_lowest: 3, third_highest: 7 }
    }

    #[test]
    fn a_disc_is_in_every_tile_it_reaches_and_at_home_in_one() {
        let up = [0.0, 0.0, 1.0];
        let surfels = [
            surfel([5.0, 5.0, 1.0], up),
            surfel([9.9, -0.1, 2.0], up),
            // Along the border, not over it.
            surfel([20.5, 5.0, 3.0], [1.0, 0.0, 0.0]),
        ];
        let map = LooseSurfels::new(10.0, 0.4, surfels).unwrap();
        let mut tiles: Vec<_> = map.tiles().map(|t| (t.id.x, t.id.y, t.own, t.surfels.len())).collect();
        tiles.sort_unstable();
        assert_eq!(tiles, [(0, -1, 1, 1), (0, 0, 1, 2), (1, -1, 0, 1), (1, 0, 0, 1), (2, 0, 1, 1)]);
        assert_eq!(map.tile_bounds(), Some([TileId { x: 0, y: -1 }, TileId { x: 2, y: 0 }]));
        let extent = map.tile_extent(TileId { x: 2, y: 0 }).unwrap();
        assert!((extent.z_range_m[0] - 2.6).abs() < 0.01 && (extent.z_range_m[1] - 3.4).abs() < 0.01);
        assert_eq!((extent.min_third_lowest, extent.max_third_highest), (3, 7));
        let copy = map.load_tile(TileId { x: 0, y: 0 }).unwrap().unwrap().surfels[1];
        assert!((copy.centre_in_tile_m[1] + 0.1).abs() < 1e-5);
        assert!(map.load_tile(TileId { x: 5, y: 5 }).unwrap().is_none());
    }

    #[test]
    fn what_is_no_disc_is_refused() {
        let up = [0.0, 0.0, 1.0];
        let of = |radius_m, one| LooseSurfels::new(32.0, radius_m, [one]);
        assert!(matches!(of(0.0, surfel([0.0; 3], up)), Err(MapError::NoLength { .. })));
        assert!(matches!(of(20.0, surfel([0.0; 3], up)), Err(MapError::NoLength { .. })));
        assert!(matches!(of(0.1, surfel([f64::NAN, 0.0, 0.0], up)), Err(MapError::OutOfWorld { .. })));
        assert!(matches!(of(0.1, surfel([0.0; 3], [0.0; 3])), Err(MapError::NoNormal { .. })));
    }
}
