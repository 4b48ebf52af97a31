//! Counts the surfels that rays pass through and end on.

use std::sync::Arc;

use dmp_disk::{BudgetCache, Weight};
use dmp_map::{Crossing, MapError, Store, Tally, TileExtent, TileId, TileSource};

use crate::journey::{JourneyBuffers, Tiles, Traveller, Wait, travel};
use crate::lanes::{Job, Simd};
use crate::path::Path;
use crate::query::{CastSettings, Query, Wanted};
use crate::rays::Rays;
use crate::within::{CastTile, Each, LEAF_DISCS, PacketRays, RAYS, SearchLists, SearchRays};

/// Tolerance, metres: a ray with a measured range within this of a crossing ended there. One whose end is farther than
/// this behind the surfel's plane passed through.
const ON_M: f64 = 0.5;

/// Counts which surfels of a stored map rays pass through and end on.
///
/// A ray *ends on* every surfel that it crosses within 0.5 m of its measured range. It *passes through* a surfel if it ends
/// more than 0.5 m behind the surfel's plane, measured perpendicular to the plane. Segments do not matter: what a vehicle
/// follows leaves its trail where the rays of the same segment go.
#[derive(Debug)]
pub struct CrossingCounter {
    store: Store,
    tiles: BudgetCache<TileId, NumberedTile>,
    path: Path,
}

#[derive(Debug)]
pub(crate) struct NumberedTile {
    tile: CastTile,
    /// For each disc of the leaves the surfel's index in the store's tile.
    places: Vec<u32>,
    surfels: usize,
}

impl Weight for NumberedTile {
    fn weight_bytes(&self) -> usize {
        self.tile.weight_bytes() + self.places.capacity() * size_of::<u32>()
    }
}

/// Per-thread buffers of [`CrossingCounter::count`].
#[derive(Debug, Default)]
pub struct CountBuffers {
    journey: JourneyBuffers,
    rays: PacketRays,
    lists: SearchLists,
    crossings: Vec<Crossing>,
}

impl CrossingCounter {
    /// A counter over `store` that keeps at most about `budget_bytes` of tiles in memory.
    pub fn new(store: Store, budget_bytes: usize) -> Self {
        Self { store, tiles: BudgetCache::new(budget_bytes), path: Path::best() }
    }

    /// The map.
    pub fn store(&self) -> &Store {
        &self.store
    }

    /// Number of tile loads so far.
    pub fn tile_loads(&self) -> u64 {
        self.tiles.loads()
    }

    /// Counts the crossings of all `queries` in `tally`. A disc over a border is counted only in the tile in which the
    /// ray crosses it, as the tile's own or as its copy: once, except for rounding at the border itself.
    ///
    /// # Errors
    /// When a tile that a ray needs is damaged, or counts cannot be spilled.
    pub fn count(
        &self,
        queries: &[Query],
        tally: &Tally,
        buffers: &mut CountBuffers,
    ) -> Result<(), MapError> {
        self.path.run(CountBlock { counter: self, queries, tally, buffers })
    }
}

impl Tiles for CrossingCounter {
    type Tile = NumberedTile;

    fn edge_m(&self) -> f64 {
        self.store.tile_edge_m()
    }

    fn bounds(&self) -> Option<[TileId; 2]> {
        self.store.tile_bounds()
    }

    fn extent(&self, tile: TileId) -> Option<TileExtent> {
        self.store.tile_extent(tile)
    }

    fn load(&self, tile: TileId) -> Result<Arc<NumberedTile>, MapError> {
        let radius_m = self.store.disc_radius_m() as f32;
        self.tiles.get(tile, || {
            let loaded = self.store.load(tile)?;
            let surfels = loaded.as_ref().map_or(0, |tile| tile.surfels.len());
            let (tile, places) =
                loaded.map_or_else(Default::default, |tile| CastTile::numbered(&tile, radius_m));
            Ok(NumberedTile { tile, places, surfels })
        })
    }
}

struct CountBlock<'a> {
    counter: &'a CrossingCounter,
    queries: &'a [Query],
    tally: &'a Tally,
    buffers: &'a mut CountBuffers,
}

impl Job for CountBlock<'_> {
    type Output = Result<(), MapError>;

    #[inline(always)]
    fn on<S: Simd>(self, simd: S) -> Self::Output {
        let Self { counter, queries, tally, buffers } = self;
        let CountBuffers { journey, rays, lists, crossings } = buffers;
        // Through all tiles up to the ray's end, whatever it crosses on the way.
        let settings = CastSettings {
            horizon_m: f64::INFINITY,
            beyond_m: ON_M,
            wanted: Wanted::First,
            ..CastSettings::default()
        };
        journey.order.as_given(queries);
        let mut counting = Counting { tally, rays, lists, crossings };
        travel(simd, counter, &settings, queries, journey, &mut counting)
    }
}

struct Counting<'a> {
    tally: &'a Tally,
    rays: &'a mut PacketRays,
    lists: &'a mut SearchLists,
    crossings: &'a mut Vec<Crossing>,
}

impl Traveller for Counting<'_> {
    type Tile = NumberedTile;

    #[inline(always)]
    fn visit<S: Simd>(
        &mut self,
        simd: S,
        id: TileId,
        numbered: &NumberedTile,
        packets: &mut [Rays],
        waits: &[Wait],
    ) -> Result<(), MapError> {
        let NumberedTile { tile, places, surfels } = numbered;
        let tile = &tile.view();
        let Self { tally, rays, lists, crossings } = self;
        crossings.clear();
        for wait in waits {
            let packet = &packets[wait.packet as usize];
            let ends = packet.in_tile(tile.origin_in_world_m, rays);
            rays.from_m = [0.0; RAYS];
            // The border itself belongs to the next tile.
            rays.to_m = ends.map(f32::next_down);
            let each = |lane: usize, leaf: usize, disc: usize, range_m: f32| {
                let beyond_m = rays.measured_m[lane] - range_m;
                let on = beyond_m <= ON_M as f32;
                // At grazing incidence the ray leaves the surfel's plane slowly, and a small error of the plane moves
                // the crossing far.
                let normal = tile.leaves[leaf].disc(disc, 3);
                let cos: f32 = (0..3).map(|k| rays.direction[k][lane] * normal[k]).sum();
                if on || beyond_m * cos.abs() > ON_M as f32 {
                    crossings.push(Crossing { surfel: places[leaf * LEAF_DISCS + disc], on });
                }
            };
            let (lanes, found) = (wait.lanes, &mut Each(each));
            simd.run(SearchRays { tile, rays, lanes, found, lists });
        }
        if !crossings.is_empty() {
            tally.add(id, *surfels, crossings)?;
        }
        Ok(())
    }

    fn arrive(&mut self, _: &[Rays]) {}
}
