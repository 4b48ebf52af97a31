use dmp_map::{BudgetCache, Independence, MapError, Store, TileEntry, TileId};

use crate::kernel::{TileAnswer, TileRay, cast};
use crate::query::{Answer, CastSettings, Query};
use crate::tree::CastTile;
use crate::walk::Walk;

/// How far before its tile a ray is looked at, metres: rounding at a border must not open a gap. Discs
/// over the border are in both tiles, so the same crossing from both sides is one crossing.
const BORDER_SLACK_M: f64 = 1e-3;

/// Casts rays into a stored map, with the tiles it needs in memory under a byte budget.
#[derive(Debug)]
pub struct Caster {
    store: Store,
    settings: CastSettings,
    tiles: BudgetCache<TileId, CastTile>,
}

/// Per-thread buffers of [`Caster::cast`].
#[derive(Debug, Default)]
pub struct CastBuffers {
    rays: Vec<RayState>,
    /// Rays by the number of tiles they have passed, each with its next tile.
    waiting: Vec<Vec<(TileId, u32)>>,
    stack: Vec<u32>,
}

/// One ray on its way, ranges from its origin.
#[derive(Debug, Clone, Copy)]
struct RayState {
    walk: Walk,
    independence: Option<Independence>,
    revisit: Option<Independence>,
    first_m: f64,
    nearest_m: f64,
    gap_m: f64,
    independent_m: f64,
    independent_cos: f32,
    revisited: bool,
}

impl Caster {
    /// A caster into `store` that keeps at most about `budget_bytes` of tiles in memory.
    pub fn new(store: Store, settings: CastSettings, budget_bytes: usize) -> Self {
        Self { store, settings, tiles: BudgetCache::new(budget_bytes) }
    }

    /// The map it casts into.
    pub fn store(&self) -> &Store {
        &self.store
    }

    /// How often a tile was loaded so far.
    pub fn tile_loads(&self) -> u64 {
        self.tiles.loads()
    }

    /// Answers every query, in order; `answers` is overwritten. The answers do not depend on how rays
    /// are grouped into blocks.
    ///
    /// # Errors
    /// When a tile that a ray needs is damaged.
    pub fn cast(
        &self,
        queries: &[Query],
        answers: &mut Vec<Answer>,
        buffers: &mut CastBuffers,
    ) -> Result<(), MapError> {
        let CastBuffers { rays, waiting, stack } = buffers;
        let edge_m = self.store.lattice().tile_edge_m();
        rays.clear();
        waiting.iter_mut().for_each(Vec::clear);
        for (index, query) in queries.iter().enumerate() {
            let mut ray = RayState::new(query, &self.settings, edge_m);
            if self.next_tile(query, &mut ray) {
                wait(waiting, &ray.walk, index as u32);
            }
            rays.push(ray);
        }
        let mut steps = 0;
        while steps < waiting.len() {
            let mut list = std::mem::take(&mut waiting[steps]);
            list.sort_unstable();
            for group in list.chunk_by(|a, b| a.0 == b.0) {
                let tile = self.tiles.get(group[0].0, || self.load(group[0].0))?;
                for &(_, index) in group {
                    let (query, ray) = (&queries[index as usize], &mut rays[index as usize]);
                    ray.cast_into(&tile, query, &self.settings, stack);
                    if ray.settled(query) {
                        continue;
                    }
                    ray.walk.advance();
                    if self.next_tile(query, ray) {
                        wait(waiting, &ray.walk, index);
                    }
                }
            }
            list.clear();
            waiting[steps] = list;
            steps += 1;
        }
        answers.clear();
        answers.extend(rays.iter().map(RayState::answer));
        Ok(())
    }

    fn load(&self, tile: TileId) -> Result<CastTile, MapError> {
        let radius_m = self.store.lattice().disc_radius_m() as f32;
        Ok(self.store.load(tile)?.map_or_else(CastTile::default, |tile| CastTile::new(&tile, radius_m)))
    }

    /// Moves the ray on to the next tile that may hold something for it; `false` when there is none.
    fn next_tile(&self, query: &Query, ray: &mut RayState) -> bool {
        let Some(bounds) = self.store.bounds() else { return false };
        loop {
            let enter_m = ray.walk.enter_m;
            if enter_m > self.settings.horizon_m || ray.walk.leaves(bounds) {
                return false;
            }
            if let Some(entry) = self.store.entry(ray.walk.tile) {
                let leave_m = ray.walk.leave_m().min(self.settings.horizon_m);
                if reaches_heights(query, entry, enter_m, leave_m) && ray.may_gain(query, entry) {
                    return true;
                }
            }
            if ray.walk.leave_m() == f64::INFINITY {
                return false;
            }
            ray.walk.advance();
        }
    }
}

pub(crate) fn wait(waiting: &mut Vec<Vec<(TileId, u32)>>, walk: &Walk, index: u32) {
    let steps = walk.steps as usize;
    if waiting.len() <= steps {
        waiting.resize_with(steps + 1, Vec::new);
    }
    waiting[steps].push((walk.tile, index));
}

pub(crate) fn reaches_heights(query: &Query, entry: &TileEntry, enter_m: f64, leave_m: f64) -> bool {
    let z_at = |range_m: f64| query.origin_in_world_m[2] + query.direction_in_world[2] * range_m;
    let (a, b) = (z_at(enter_m - 1.0), z_at(leave_m + 1.0));
    // A metre before and behind: discs reach a little over the tile's border.
    a.max(b) >= entry.z_range_m[0] && a.min(b) <= entry.z_range_m[1]
}

impl RayState {
    fn new(query: &Query, settings: &CastSettings, tile_edge_m: f64) -> Self {
        let [independence, revisit] = settings.independence(query.segment);
        Self {
            walk: Walk::new(query.origin_in_world_m, query.direction_in_world, tile_edge_m),
            independence,
            revisit,
            first_m: f64::INFINITY,
            nearest_m: f64::INFINITY,
            gap_m: settings.window_m,
            independent_m: f64::INFINITY,
            independent_cos: 0.0,
            revisited: false,
        }
    }

    /// Whether a tile may still change an answer, by its distance and by what its surfels were seen from.
    fn may_gain(&self, query: &Query, entry: &TileEntry) -> bool {
        let may_hold = |independence: Option<Independence>| {
            independence.is_some_and(|i| i.holds(entry.min_third_lowest, entry.max_third_highest))
        };
        let enter_m = self.walk.enter_m - BORDER_SLACK_M;
        enter_m < self.first_m
            || enter_m <= query.measured_m + self.gap_m
            || (enter_m < self.independent_m && may_hold(self.independence))
            || (!self.revisited && may_hold(self.revisit))
    }

    /// Whether nothing beyond this tile can change an answer.
    fn settled(&self, query: &Query) -> bool {
        let leave_m = self.walk.leave_m();
        self.first_m <= leave_m
            && query.measured_m + self.gap_m <= leave_m
            && (self.independence.is_none() || self.independent_m <= leave_m)
            && (self.revisit.is_none() || self.revisited)
    }

    fn cast_into(&mut self, tile: &CastTile, query: &Query, settings: &CastSettings, stack: &mut Vec<u32>) {
        let enter_m = self.walk.enter_m;
        let d = query.direction_in_world;
        let origin_m = std::array::from_fn(|k| {
            (query.origin_in_world_m[k] + d[k] * enter_m - tile.origin_in_world_m[k]) as f32
        });
        let ray = TileRay {
            origin_m,
            direction: d.map(|c| c as f32),
            measured_m: (query.measured_m - enter_m) as f32,
            from_m: if self.walk.steps == 0 { 0.0 } else { -BORDER_SLACK_M as f32 },
            to_m: (settings.horizon_m - enter_m) as f32,
            independence: self.independence,
            revisit: self.revisit,
        };
        // What was found before this tile is final. Discs over the border are met again here, rounded
        // another way; without this an answer would depend on what else the walk goes on for.
        let open =
            |range_m: f64| if range_m <= enter_m { f32::NEG_INFINITY } else { (range_m - enter_m) as f32 };
        let nearest_is_final = query.measured_m + self.gap_m <= enter_m;
        let mut found = TileAnswer {
            first_m: open(self.first_m),
            // Of two equally near the one found first along the ray stays.
            nearest_m: if self.nearest_m.is_finite() { f32::NEG_INFINITY } else { f32::INFINITY },
            gap_m: if nearest_is_final { f32::NEG_INFINITY } else { self.gap_m as f32 },
            independent_m: open(self.independent_m),
            independent_cos: self.independent_cos,
            revisited: self.revisited,
        };
        let before = found;
        cast(tile, &ray, &mut found, stack);
        if found.first_m < before.first_m {
            self.first_m = enter_m + f64::from(found.first_m);
        }
        if found.nearest_m.is_finite() {
            self.nearest_m = enter_m + f64::from(found.nearest_m);
            self.gap_m = (self.nearest_m - query.measured_m).abs();
        }
        if found.independent_m < before.independent_m {
            self.independent_m = enter_m + f64::from(found.independent_m);
        }
        self.independent_cos = found.independent_cos;
        self.revisited = found.revisited;
    }

    fn answer(&self) -> Answer {
        let range = |range_m: f64| range_m.is_finite().then_some(range_m);
        Answer {
            first_m: range(self.first_m),
            nearest_m: range(self.nearest_m),
            independent_m: range(self.independent_m),
            independent_cos: self.independent_m.is_finite().then_some(self.independent_cos),
            revisited: self.revisited,
        }
    }
}
