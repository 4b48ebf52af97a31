//! The normals of what rays cross first.
//!
//! The kernels keep ranges alone: to carry along which disc a range is of would cost every ray, and scores ask for none.
//! So normals are a second look, of the rays that ask, in the tile where each found its first: no further and no nearer
//! than that range. Few boxes hold one place, and crossings have one formula, so the disc is the one that was crossed.

use crate::lanes::Simd;
use crate::packet::{PacketAnswers, Visit};
use crate::packet_rays::RAYS;
use crate::search::{Each, SearchLists, SearchRays};
use crate::tile::TileView;

/// A unit normal in the world.
pub(crate) type Normal = [f32; 3];

/// The normals of the discs that some rays of a visit have crossed first, where that is nearer than `before`, turned
/// towards where the rays come from. Of discs crossed in the same place it is the one that comes first in the tree.
///
/// The visit's rays end at these places then.
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
