use dmp_map::{BudgetCache, Crossing, Independence, MapError, Store, Tally, TileId, Weight};

use crate::caster::{reaches_heights, wait};
use crate::kernel::{TileRay, each_crossing};
use crate::query::Query;
use crate::tree::CastTile;
use crate::walk::Walk;

/// A ray that measured something within this of a crossing ended there; one that measured something
/// further than this behind the surfel's plane went through, metres.
const ON_M: f64 = 0.5;

/// Counts which surfels of a stored map rays go through and on which they end.
///
/// A ray *ends on* every surfel that it crosses within 0.5 m of its measured range, whatever was seen when. It
/// *goes through* a surfel whose plane it leaves more than 0.5 m behind, at right angles to the plane; this is
/// counted where the surfel is independent of the ray, so that no part of the drive speaks against itself.
#[derive(Debug)]
pub struct CrossingCounter {
    store: Store,
    reach: i32,
    tiles: BudgetCache<TileId, NumberedTile>,
}

#[derive(Debug)]
struct NumberedTile {
    tile: CastTile,
    /// For each surfel of the leaves its place in the store's tile.
    places: Vec<u32>,
}

impl Weight for NumberedTile {
    fn weight_bytes(&self) -> usize {
        self.tile.weight_bytes() + self.places.capacity() * size_of::<u32>()
    }
}

/// Per-thread buffers of [`CrossingCounter::count`].
#[derive(Debug, Default)]
pub struct CountBuffers {
    walks: Vec<Walk>,
    waiting: Vec<Vec<(TileId, u32)>>,
    stack: Vec<u32>,
    crossings: Vec<Crossing>,
}

impl CrossingCounter {
    /// A counter over `store` that keeps at most about `budget_bytes` of tiles in memory; `reach` segments to
    /// each side of a ray's own are not independent of it.
    pub fn new(store: Store, reach: i32, budget_bytes: usize) -> Self {
        Self { store, reach, tiles: BudgetCache::new(budget_bytes) }
    }

    /// The map.
    pub fn store(&self) -> &Store {
        &self.store
    }

    /// How often a tile was loaded so far.
    pub fn tile_loads(&self) -> u64 {
        self.tiles.loads()
    }

    /// Counts the crossings of all `queries` in `tally`. A disc over a border is counted in the tile in which
    /// the ray crosses it, so once, as the tile's own or as its copy.
    ///
    /// # Errors
    /// When a tile that a ray needs is damaged, or the tally cannot put counts aside.
    pub fn count(
        &self,
        queries: &[Query],
        tally: &Tally,
        buffers: &mut CountBuffers,
    ) -> Result<(), MapError> {
        let CountBuffers { walks, waiting, stack, crossings } = buffers;
        let edge_m = self.store.lattice().tile_edge_m();
        walks.clear();
        waiting.iter_mut().for_each(Vec::clear);
        for (index, query) in queries.iter().enumerate() {
            let mut walk = Walk::new(query.origin_in_world_m, query.direction_in_world, edge_m);
            if self.next_tile(query, &mut walk) {
                wait(waiting, &walk, index as u32);
            }
            walks.push(walk);
        }
        let mut steps = 0;
        while steps < waiting.len() {
            let mut list = std::mem::take(&mut waiting[steps]);
            list.sort_unstable();
            for group in list.chunk_by(|a, b| a.0 == b.0) {
                let id = group[0].0;
                let numbered = self.tiles.get(id, || self.load(id))?;
                crossings.clear();
                for &(_, index) in group {
                    let (query, walk) = (&queries[index as usize], &mut walks[index as usize]);
                    self.count_in(&numbered, query, walk, stack, crossings);
                    if walk.leave_m() < f64::INFINITY {
                        walk.advance();
                        if self.next_tile(query, walk) {
                            wait(waiting, walk, index);
                        }
                    }
                }
                if !crossings.is_empty() {
                    tally.add(id, numbered.places.len(), crossings)?;
                }
            }
            list.clear();
            waiting[steps] = list;
            steps += 1;
        }
        Ok(())
    }

    fn load(&self, tile: TileId) -> Result<NumberedTile, MapError> {
        let radius_m = self.store.lattice().disc_radius_m() as f32;
        let (tile, places) =
            self.store.load(tile)?.map_or_else(Default::default, |tile| CastTile::numbered(&tile, radius_m));
        Ok(NumberedTile { tile, places })
    }

    fn next_tile(&self, query: &Query, walk: &mut Walk) -> bool {
        let Some(bounds) = self.store.bounds() else { return false };
        let end_m = query.measured_m + ON_M;
        loop {
            if walk.enter_m > end_m || walk.leaves(bounds) {
                return false;
            }
            let leave_m = walk.leave_m().min(end_m);
            if self
                .store
                .entry(walk.tile)
                .is_some_and(|entry| reaches_heights(query, entry, walk.enter_m, leave_m))
            {
                return true;
            }
            if walk.leave_m() == f64::INFINITY {
                return false;
            }
            walk.advance();
        }
    }

    fn count_in(
        &self,
        numbered: &NumberedTile,
        query: &Query,
        walk: &Walk,
        stack: &mut Vec<u32>,
        crossings: &mut Vec<Crossing>,
    ) {
        let NumberedTile { tile, places } = numbered;
        let enter_m = walk.enter_m;
        let d = query.direction_in_world;
        let independence = query.segment.map(|segment| Independence::of(segment, self.reach));
        let leave_m = (walk.leave_m() - enter_m) as f32;
        let ray = TileRay {
            origin_m: std::array::from_fn(|k| {
                (query.origin_in_world_m[k] + d[k] * enter_m - tile.origin_in_world_m[k]) as f32
            }),
            direction: d.map(|c| c as f32),
            measured_m: (query.measured_m - enter_m) as f32,
            from_m: 0.0,
            to_m: leave_m.min((query.measured_m + ON_M - enter_m) as f32),
            independence,
            revisit: None,
        };
        each_crossing(tile, &ray, stack, |place, range_m| {
            let surfel = &tile.surfels[place];
            let is_independent =
                || independence.is_some_and(|i| i.holds(surfel.third_lowest, surfel.third_highest));
            let beyond_m = ray.measured_m - range_m;
            let on = beyond_m <= ON_M as f32;
            // At grazing incidence the ray leaves the surfel's plane slowly, and a small error of the plane
            // moves the crossing far.
            let cos: f32 = (0..3).map(|k| ray.direction[k] * surfel.normal[k]).sum();
            let through = || beyond_m * cos.abs() > ON_M as f32 && is_independent();
            if range_m < leave_m && (on || through()) {
                crossings.push(Crossing { surfel: places[place], on });
            }
        });
    }
}
