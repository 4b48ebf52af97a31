//! The state of sixteen rays that traverse the tiles.

mod route;

use dmp_map::Independence;

use crate::lanes::fetch;
use crate::query::{Answer, CastSettings, Query, Wanted};
use crate::within::{PacketAnswers, PacketRays, RAYS};

/// Rays start this far before their tile, metres: so rounding at a border opens no gap. Discs over the border are in
/// both tiles, and a crossing found from both sides is one crossing.
const BORDER_SLACK_M: f64 = 1e-3;

/// Rays from farther out find nothing, nor do those whose direction is NaN or no unit vector: their traversal would not
/// end, and they would spoil their packets. Maps end there too.
const WORLD_LIMIT_M: f64 = 5e7;

type Column = [f64; RAYS];

/// A packet: up to sixteen rays of one segment and their answers so far, ranges from their origins.
///
/// All data is in columns and computed for all lanes. Lanes without a ray repeat the first ray; their results are
/// ignored.
#[derive(Debug, Clone)]
#[repr(align(64))]
pub(crate) struct Rays {
    origin_in_world_m: [Column; 3],
    direction_in_world: [Column; 3],
    measured_m: Column,
    /// Crossings farther than this do not count.
    end_m: Column,
    /// Range at which each enters its current tile.
    enter_m: Column,
    /// Ranges of the next border across x and across y.
    next_m: [Column; 2],
    first_m: Column,
    nearest_m: Column,
    gap_m: Column,
    independent_m: Column,
    /// A bit for each ray.
    revisited: u32,
    /// Column and row of each ray's current tile.
    tile: [[i32; RAYS]; 2],
    /// Number of tiles each has passed since its first: equal for all rays that enter a tile from the same tile.
    steps: [u32; RAYS],
    query: [u32; RAYS],
    count: usize,
    asked: Asked,
    /// [`CastSettings::return_m`].
    return_m: f64,
}

/// The common settings of a packet's rays.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Asked {
    pub(crate) independence: Option<Independence>,
    pub(crate) revisit: Option<Independence>,
}

impl Rays {
    pub(crate) const EMPTY: Self = Self {
        origin_in_world_m: [[0.0; RAYS]; 3],
        direction_in_world: [[0.0; RAYS]; 3],
        measured_m: [0.0; RAYS],
        end_m: [0.0; RAYS],
        enter_m: [0.0; RAYS],
        next_m: [[0.0; RAYS]; 2],
        first_m: [0.0; RAYS],
        nearest_m: [0.0; RAYS],
        gap_m: [0.0; RAYS],
        independent_m: [0.0; RAYS],
        revisited: 0,
        tile: [[0; RAYS]; 2],
        steps: [0; RAYS],
        query: [0; RAYS],
        count: 0,
        asked: Asked { independence: None, revisit: None },
        return_m: 0.0,
    };

    /// Starts with the rays of `queries` at the indices in the low halves of `order`: one to sixteen of one segment.
    #[inline(always)]
    pub(crate) fn fill(
        &mut self,
        queries: &[Query],
        order: &[u64],
        settings: &CastSettings,
        tile_edge_m: f64,
    ) {
        let index_of = |lane: usize| order[if lane < order.len() { lane } else { 0 }] as u32;
        let [independence, revisit] = match settings.wanted {
            Wanted::First => [None; 2],
            Wanted::Three => settings.independence(queries[index_of(0) as usize].segment),
        };
        let asked = Asked { independence, revisit };
        self.return_m = settings.return_m;
        let window_m = match settings.wanted {
            Wanted::First => f64::NEG_INFINITY,
            Wanted::Three => settings.window_m,
        };
        self.first_m = [f64::INFINITY; RAYS];
        self.nearest_m = [f64::INFINITY; RAYS];
        self.gap_m = [window_m; RAYS];
        self.independent_m = [f64::INFINITY; RAYS];
        self.enter_m = [0.0; RAYS];
        self.revisited = 0;
        self.steps = [0; RAYS];
        self.count = order.len();
        self.asked = asked;
        for lane in 0..RAYS {
            let index = index_of(lane);
            let query = &queries[index as usize];
            self.query[lane] = index;
            for k in 0..3 {
                self.origin_in_world_m[k][lane] = query.ray.origin_in_world[k];
                self.direction_in_world[k][lane] = query.ray.direction_in_world[k];
            }
            self.measured_m[lane] = query.ray.range_m;
        }
        for lane in 0..RAYS {
            let end_m = self.measured_m[lane] + settings.beyond_m;
            self.end_m[lane] = if end_m < settings.horizon_m { end_m } else { settings.horizon_m };
        }
        let ([ox, oy, oz], [dx, dy, dz]) = (&self.origin_in_world_m, &self.direction_in_world);
        for lane in 0..RAYS {
            let inside = |o: f64| o.abs() <= WORLD_LIMIT_M;
            let norm2 = dx[lane] * dx[lane] + dy[lane] * dy[lane] + dz[lane] * dz[lane];
            // False for NaN.
            let is_ray =
                inside(ox[lane]) & inside(oy[lane]) & inside(oz[lane]) & (norm2 > 0.5) & (norm2 < 2.0);
            self.end_m[lane] = if is_ray { self.end_m[lane] } else { f64::NEG_INFINITY };
        }
        for k in 0..2 {
            for lane in 0..RAYS {
                let (o, d) = (self.origin_in_world_m[k][lane], self.direction_in_world[k][lane]);
                let cell = (o / tile_edge_m).floor();
                let border = (cell + if d > 0.0 { 1.0 } else { 0.0 }) * tile_edge_m;
                self.tile[k][lane] = cell as i32;
                self.next_m[k][lane] = if d == 0.0 { f64::INFINITY } else { (border - o) / d };
            }
        }
    }

    /// The index of a ray's query.
    #[inline(always)]
    pub(crate) fn query(&self, lane: usize) -> usize {
        self.query[lane] as usize
    }

    #[inline(always)]
    pub(crate) fn asked(&self) -> Asked {
        self.asked
    }

    /// A bit for each ray.
    #[inline(always)]
    pub(crate) fn lanes(&self) -> u32 {
        (1 << self.count) - 1
    }

    /// The rays in their current tile, each up to [`CastSettings::return_m`] behind its measured range; crossings
    /// beyond the tile's border count. Returns each ray's end without that bound.
    #[inline(always)]
    pub(crate) fn in_tile(&self, tile_origin_in_world_m: [f64; 3], rays: &mut PacketRays) -> [f32; RAYS] {
        for k in 0..3 {
            for lane in 0..RAYS {
                let (o, d) = (self.origin_in_world_m[k][lane], self.direction_in_world[k][lane]);
                rays.origin_m[k][lane] = (o + d * self.enter_m[lane] - tile_origin_in_world_m[k]) as f32;
                rays.direction[k][lane] = d as f32;
            }
        }
        let mut ends = [0.0; RAYS];
        for lane in 0..RAYS {
            let enter_m = self.enter_m[lane];
            rays.measured_m[lane] = (self.measured_m[lane] - enter_m) as f32;
            rays.from_m[lane] = if self.steps[lane] == 0 { 0.0 } else { -BORDER_SLACK_M as f32 };
            let leave_m = self.leave_m(lane);
            let end_m = if leave_m < self.end_m[lane] { leave_m } else { self.end_m[lane] };
            ends[lane] = (end_m - enter_m) as f32;
            let place_m = (self.measured_m[lane] + self.return_m - enter_m) as f32;
            rays.place_m[lane] = place_m;
            rays.to_m[lane] = if place_m < ends[lane] { place_m } else { ends[lane] };
        }
        ends
    }

    /// The answers so far, from the tile's border on.
    ///
    /// Answers found before this tile are final. Discs over the border are met again here with other rounding; without
    /// this rule an answer would depend on the other answers requested.
    #[inline(always)]
    pub(crate) fn answers_in_tile(&self, answers: &mut PacketAnswers) {
        let none = f32::NEG_INFINITY;
        for lane in 0..RAYS {
            let enter_m = self.enter_m[lane];
            let (first, independent) = (self.first_m[lane], self.independent_m[lane]);
            answers.first_m[lane] = if first <= enter_m { none } else { (first - enter_m) as f32 };
            answers.independent_m[lane] =
                if independent <= enter_m { none } else { (independent - enter_m) as f32 };
            // Of two equally near, the first one found along the ray stays.
            answers.nearest_m[lane] = if self.nearest_m[lane] < f64::INFINITY { none } else { f32::INFINITY };
            let is_final = self.measured_m[lane] + self.gap_m[lane] <= enter_m;
            answers.gap_m[lane] = if is_final { none } else { self.gap_m[lane] as f32 };
        }
        answers.revisited = self.revisited;
    }

    /// Takes, for some rays, what was found in the tile since [`Self::answers_in_tile`] returned `before`.
    #[inline(always)]
    pub(crate) fn take(&mut self, lanes: u32, before: &PacketAnswers, found: &PacketAnswers) {
        for lane in 0..RAYS {
            let is_in = lanes >> lane & 1 == 1;
            let enter_m = self.enter_m[lane];
            let first = found.first_m[lane];
            if is_in & (first < before.first_m[lane]) {
                self.first_m[lane] = enter_m + f64::from(first);
            }
            let nearest = found.nearest_m[lane];
            if is_in & (nearest.abs() < f32::INFINITY) {
                self.nearest_m[lane] = enter_m + f64::from(nearest);
                self.gap_m[lane] = (enter_m + f64::from(nearest) - self.measured_m[lane]).abs();
            }
            let independent = found.independent_m[lane];
            if is_in & (independent < before.independent_m[lane]) {
                self.independent_m[lane] = enter_m + f64::from(independent);
            }
        }
        self.revisited |= found.revisited & lanes;
    }

    /// Prefetches the memory of the answers.
    #[inline(always)]
    pub(crate) fn fetch_answers(&self, answers: &[Answer]) {
        self.query[..self.count].iter().for_each(|&query| fetch(&answers[query as usize]));
    }

    /// Writes every ray's answer to its query's index.
    #[inline(always)]
    pub(crate) fn answer(&self, answers: &mut [Answer]) {
        let range = |range_m: f64| (range_m < f64::INFINITY).then_some(range_m);
        for lane in 0..self.count {
            answers[self.query[lane] as usize] = Answer {
                first_m: range(self.first_m[lane]),
                nearest_m: range(self.nearest_m[lane]),
                independent_m: range(self.independent_m[lane]),
                revisited: self.revisited >> lane & 1 == 1,
            };
        }
    }
}
