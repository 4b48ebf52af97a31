//! Computes the normals of rays' first crossings.
//!
//! The kernels keep only ranges: to keep the disc as well would cost every ray, and scores need none. So normals are a
//! second search, for the rays that request them, in the tile of their first crossing and at exactly that range. Few
//! boxes contain one place, and crossings have one formula, so the same disc is found.

use crate::lanes::Simd;
use crate::within::{Each, PacketAnswers, RAYS, SearchLists, SearchRays, TileView, Visit};

/// A unit normal in the world.
pub(crate) type Normal = [f32; 3];

/// The normals of the discs that some rays of a visit cross first, if nearer than `before`, turned towards the rays'
/// origins. Among discs crossed at the same place, the first in the tree is chosen.
///
/// Afterwards the visit's rays end at these places.
#[inline(always)]
pub(crate) fn normals<S: Simd>(
    simd: S,
    tile: &TileView,
    visit: &mut Visit,
    before: &PacketAnswers,
    lanes: u32,
    lists: &mut SearchLists,
) -> [Option<Normal>; RAYS] {
    let Visit { rays, answers, .. } = visit;
    let mut nearer = 0;
    for lane in 0..RAYS {
        nearer |= u32::from(answers.first_m[lane] < before.first_m[lane]) << lane;
    }
    let mut normals = [None; RAYS];
    let lanes = nearer & lanes;
    if lanes == 0 {
        return normals;
    }
    (rays.from_m, rays.to_m) = (answers.first_m, answers.first_m);
    let each = |lane: usize, leaf: usize, disc: usize, _: f32| {
        if normals[lane].is_none() {
            let normal = tile.leaves[leaf].disc(disc, 3);
            let cos: f32 = (0..3).map(|k| rays.direction[k][lane] * normal[k]).sum();
            normals[lane] = Some(if cos > 0.0 { normal.map(|n| -n) } else { normal });
        }
    };
    simd.run(SearchRays { tile, rays, lanes, found: &mut Each(each), lists });
    normals
}
