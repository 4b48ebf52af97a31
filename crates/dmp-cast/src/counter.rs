//! Counts the surfels that rays pass through and end on.

use std::ops::RangeInclusive;
use std::sync::{Arc, Mutex, PoisonError};

use dmp_disk::{BudgetCache, Weight};
use dmp_map::{Crossing, MapError, Store, Surfel, Tally, TileExtent, TileId, TileSource};

use crate::journey::{JourneyBuffers, Tiles, Traveller, Wait, travel};
use crate::lanes::{Job, Simd};
use crate::path::Path;
use crate::query::{CastSettings, Query, Wanted};
use crate::rays::Rays;
use crate::within::{CastTile, Each, LEAF_DISCS, PacketRays, RAYS, SearchLists, SearchRays};

/// Counts which surfels of a stored map rays pass through and end on.
///
/// A ray *ends on* every surfel that it crosses within a tolerance of its measured range. It *passes through* a surfel if
/// it ends farther than the tolerance behind the surfel's plane, measured perpendicular to the plane. Only rays measured
/// at about the time at which the surfel was seen count: later ones may show an error of the trajectory instead.
#[derive(Debug)]
pub struct CrossingCounter {
    store: Store,
    on_m: f64,
    tiles: BudgetCache<TileId, NumberedTile>,
    /// Building a tile takes several times what it holds: one at a time.
    building: Mutex<()>,
    path: Path,
}

#[derive(Debug, Default)]
pub(crate) struct NumberedTile {
    tile: CastTile,
    /// For each disc of the leaves the surfel's index in the store's tile.
    places: Vec<u32>,
    /// For each surfel the first and last segment in which it was seen, apart from two observations.
    seen: Vec<[i32; 2]>,
}

impl Weight for NumberedTile {
    fn weight_bytes(&self) -> usize {
        self.tile.weight_bytes()
            + self.places.capacity() * size_of::<u32>()
            + self.seen.capacity() * size_of::<[i32; 2]>()
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
    /// A counter over `store` that keeps at most about `budget_bytes` of tiles in memory; `on_m` is the tolerance, metres.
    pub fn new(store: Store, on_m: f64, budget_bytes: usize) -> Self {
        Self {
            store,
            on_m,
            tiles: BudgetCache::new(budget_bytes),
            building: Mutex::default(),
            path: Path::best(),
        }
    }

    /// The map.
    pub fn store(&self) -> &Store {
        &self.store
    }

    /// Number of tile loads so far.
    pub fn tile_loads(&self) -> u64 {
        self.tiles.loads()
    }

    /// Counts in `tally` how all `queries`, measured in a segment, cross the surfels seen in the segments of its `pass`.
    /// Of a disc over a border, the part in its own tile counts.
    ///
    /// # Errors
    /// When a tile that a ray needs is damaged, or counts cannot be spilled.
    pub fn count(
        &self,
        queries: &[Query],
        pass: RangeInclusive<i32>,
        tally: &Tally,
        buffers: &mut CountBuffers,
    ) -> Result<(), MapError> {
        self.path.run(CountBlock { counter: self, queries, pass, tally, buffers })
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
            let _one = self.building.lock().unwrap_or_else(PoisonError::into_inner);
            let Some(mut tile) = self.store.load(tile)? else { return Ok(NumberedTile::default()) };
            tile.surfels.truncate(tile.own);
            tile.surfels.shrink_to_fit();
            // The third-lowest of three segments may be the highest.
            let ends =
                |s: &Surfel| [s.third_lowest.min(s.third_highest), s.third_lowest.max(s.third_highest)];
            let seen = tile.surfels.iter().map(ends).collect();
            let (tile, places) = CastTile::numbered(&tile, radius_m);
            Ok(NumberedTile { tile, places, seen })
        })
    }
}

struct CountBlock<'a> {
    counter: &'a CrossingCounter,
    queries: &'a [Query],
    pass: RangeInclusive<i32>,
    tally: &'a Tally,
    buffers: &'a mut CountBuffers,
}

impl Job for CountBlock<'_> {
    type Output = Result<(), MapError>;

    #[inline(always)]
    fn on<S: Simd>(self, simd: S) -> Self::Output {
        let Self { counter, queries, pass, tally, buffers } = self;
        let CountBuffers { journey, rays, lists, crossings } = buffers;
        // Through all tiles up to the ray's end, whatever it crosses on the way.
        let settings = CastSettings {
            horizon_m: f64::INFINITY,
            beyond_m: counter.on_m,
            wanted: Wanted::First,
            ..CastSettings::default()
        };
        journey.order.as_given(queries);
        let mut counting = Counting { on_m: counter.on_m as f32, pass, tally, rays, lists, crossings };
        travel(simd, counter, &settings, queries, journey, &mut counting)
    }
}

struct Counting<'a> {
    on_m: f32,
    pass: RangeInclusive<i32>,
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
        let NumberedTile { tile, places, seen } = numbered;
        let tile = &tile.view();
        let Self { on_m, pass, tally, rays, lists, crossings } = self;
        let (on_m, first, last) = (*on_m, *pass.start(), *pass.end());
        crossings.clear();
        for wait in waits {
            let packet = &packets[wait.packet as usize];
            let ends = packet.in_tile(tile.origin_in_world_m, rays);
            rays.from_m = [0.0; RAYS];
            // The border itself belongs to the next tile.
            rays.to_m = ends.map(f32::next_down);
            let each = |lane: usize, leaf: usize, disc: usize, range_m: f32| {
                let surfel = places[leaf * LEAF_DISCS + disc];
                let [low, high] = seen[surfel as usize];
                if high < first || last < low {
                    return;
                }
                let beyond_m = rays.measured_m[lane] - range_m;
                let on = beyond_m <= on_m;
                // At grazing incidence the ray leaves the surfel's plane slowly, and a small error of the plane moves
                // the crossing far.
                let normal = tile.leaves[leaf].disc(disc, 3);
                let cos: f32 = (0..3).map(|k| rays.direction[k][lane] * normal[k]).sum();
                if on || beyond_m * cos.abs() > on_m {
                    crossings.push(Crossing { surfel, on });
                }
            };
            let (lanes, found) = (wait.lanes, &mut Each(each));
            simd.run(SearchRays { tile, rays, lanes, found, lists });
        }
        if !crossings.is_empty() {
            tally.add(id, seen.len(), crossings)?;
        }
        Ok(())
    }

    fn arrive(&mut self, _: &[Rays]) {}
}
