//! Finds the discs that rays cross at one of their answers.
//!
//! The kernels keep only ranges: to keep the disc as well would cost every ray, and scores need none. So discs are a second
//! search, for the rays that request them, in the tile of their crossing and at exactly that range. Few boxes contain one
//! place, and crossings have one formula, so the same disc is found.

use crate::lanes::Simd;
use crate::query::{Hit, HitDisc};
use crate::within::{Each, PacketAnswers, RAYS, SearchLists, SearchRays, TileView, Visit};

/// The discs that some rays of a visit cross at `hit`, if that was found in this tile, their normals turned towards the rays'
/// origins. Among discs crossed at the same place, the first in the tree is chosen.
///
/// Afterwards the visit's rays end at these places.
#[inline(always)]
pub(crate) fn discs<S: Simd>(
    simd: S,
    tile: &TileView,
    visit: &mut Visit,
    before: &PacketAnswers,
    (hit, lanes): (Hit, u32),
    lists: &mut SearchLists,
) -> [Option<HitDisc>; RAYS] {
    let Visit { rays, answers, independence, .. } = visit;
    let mut found_here = 0;
    for lane in 0..RAYS {
        let is_new = match hit {
            Hit::First => answers.first_m[lane] < before.first_m[lane],
            // Infinite unless it was found here: see `Rays::answers_in_tile`.
            Hit::Nearest => answers.nearest_m[lane].abs() < f32::INFINITY,
            Hit::Independent => answers.independent_m[lane] < before.independent_m[lane],
        };
        found_here |= u32::from(is_new) << lane;
    }
    let mut discs = [None; RAYS];
    let lanes = found_here & lanes;
    if lanes == 0 {
        return discs;
    }
    let at_m = match hit {
        Hit::First => answers.first_m,
        Hit::Nearest => answers.nearest_m,
        Hit::Independent => answers.independent_m,
    };
    (rays.from_m, rays.to_m) = (at_m, at_m);
    let each = |lane: usize, leaf: usize, disc: usize, _: f32| {
        let [low, high] = tile.support[leaf].of(disc);
        if discs[lane].is_some()
            || hit == Hit::Independent && !independence.is_some_and(|i| i.holds(low, high))
        {
            return;
        }
        let [centre, normal] = [0, 3].map(|column| tile.leaves[leaf].disc(disc, column));
        let cos: f32 = (0..3).map(|k| rays.direction[k][lane] * normal[k]).sum();
        discs[lane] = Some(HitDisc {
            centre_in_world_m: std::array::from_fn(|k| tile.origin_in_world_m[k] + f64::from(centre[k])),
            normal_in_world: if cos > 0.0 { normal.map(|n| -n) } else { normal },
        });
    };
    simd.run(SearchRays { tile, rays, lanes, found: &mut Each(each), lists });
    discs
}
