//! Casts rays one by one within a tile: each traverses the tree by itself.
//!
//! A single ray would wait at every node for the previous result. So sixteen alternate: a list of pairs of a ray and a
//! node is processed from the front and grows at its end.

use super::crossing::{MIN_COS, columns, plane_crossing};
use super::lists::grow_to;
use super::packet_rays::{Column, PacketRays, RAYS, load3};
use super::tile::{LEAF_DISCS, Node, TileView, WIDTH};
use crate::lanes::{Job, Lanes, Mask, Simd, fetch};

/// Tolerance for the rounding of boxes and ranges, metres.
const SLACK_M: f32 = 1e-4;
/// Replaces 1/0 for a zero direction component: products with it are large and never NaN.
const STEEPEST: f32 = 1e20;
/// Leaves are prefetched this many steps ahead.
const LEAVES_AHEAD: usize = 2;
/// Bits of a pair for the ray's number.
const LANE_BITS: u32 = RAYS.ilog2();

/// A search along rays.
pub(crate) trait Search {
    /// The children of a node that may matter to a ray, among those it crosses: all by default.
    #[inline(always)]
    fn children<S: Simd>(
        &self,
        simd: S,
        _lane: usize,
        _node: &Node,
        _enter_m: S::Eight,
        _leave_m: S::Eight,
    ) -> <S::Eight as Lanes>::Mask {
        S::Eight::mask_of(simd.eight(), u32::MAX)
    }

    /// Receives a ray's crossings with the discs of a leaf.
    fn take<S: Simd>(
        &mut self,
        simd: S,
        lane: usize,
        leaf: usize,
        ranges_m: S::Sixteen,
        hits: <S::Sixteen as Lanes>::Mask,
    );
}

/// Lists of [`SearchRays`], reused.
#[derive(Debug, Default)]
pub(crate) struct SearchLists {
    /// A node and a ray.
    nodes: Vec<u32>,
    /// A leaf and a ray.
    leaves: Vec<u32>,
}

/// Passes all crossings of some rays to `found`, in arbitrary order.
pub(crate) struct SearchRays<'a, F> {
    pub(crate) tile: &'a TileView<'a>,
    pub(crate) rays: &'a PacketRays,
    /// A bit for each ray.
    pub(crate) lanes: u32,
    pub(crate) found: &'a mut F,
    pub(crate) lists: &'a mut SearchLists,
}

impl<F: Search> Job for SearchRays<'_, F> {
    type Output = ();

    #[inline(always)]
    fn on<S: Simd>(self, simd: S) {
        let Self { tile, rays, lanes, found, lists } = self;
        if tile.nodes.is_empty() {
            return;
        }
        let pairs = gather(simd, tile, rays, lanes, found, lists);
        let wide = simd.sixteen();
        let radius2 = S::Sixteen::splat(wide, tile.radius_m * tile.radius_m);
        let min_cos = S::Sixteen::splat(wide, MIN_COS);
        for (k, &pair) in pairs.iter().enumerate() {
            if let Some(&later) = pairs.get(k + LEAVES_AHEAD) {
                fetch(&tile.leaves[(later >> LANE_BITS) as usize]);
            }
            let (leaf, lane) = ((pair >> LANE_BITS) as usize, pair as usize % RAYS);
            let discs = &tile.leaves[leaf];
            let (origin, direction) = (of_lane(&rays.origin_m, lane), of_lane(&rays.direction, lane));
            let (range, cos, off2) = plane_crossing(
                S::Sixteen::splat3(wide, origin),
                S::Sixteen::splat3(wide, direction),
                columns(simd, discs, 0),
                columns(simd, discs, 3),
            );
            let hits = min_cos.le(cos.abs())
                & off2.le(radius2)
                & S::Sixteen::splat(wide, rays.from_m[lane]).le(range)
                & range.le(S::Sixteen::splat(wide, rays.to_m[lane]));
            found.take(simd, lane, leaf, range, hits);
        }
    }
}

/// Pairs of a leaf and a ray that may meet.
#[inline(always)]
fn gather<'a, S: Simd, F: Search>(
    simd: S,
    tile: &TileView,
    rays: &PacketRays,
    lanes: u32,
    found: &F,
    lists: &'a mut SearchLists,
) -> &'a [u32] {
    let eight = simd.eight();
    let slabs = Slabs::new(simd, rays);
    let SearchLists { nodes, leaves } = lists;
    grow_to(nodes, RAYS);
    // Every ray starts at the root.
    S::Sixteen::pack_lanes(simd.sixteen(), 0, lanes, nodes);
    let (mut at, mut end, mut count) = (0, lanes.count_ones() as usize, 0);
    while at < end {
        grow_to(nodes, end + WIDTH);
        grow_to(leaves, count + WIDTH);
        let (index, lane) = ((nodes[at] >> LANE_BITS) as usize, nodes[at] as usize % RAYS);
        at += 1;
        let node = &tile.nodes[index];
        let (enter, leave) = slabs.through(simd, rays, lane, node);
        let inside = (enter.le(leave) & found.children(simd, lane, node, enter, leave)).bits();
        let (below, here) = (inside & !node.leaves, inside & node.leaves);
        let pair = S::Eight::tagged(eight, &node.children, LANE_BITS, lane as u32);
        S::Eight::pack(pair, below, &mut nodes[end..]);
        S::Eight::pack(pair, here, &mut leaves[count..]);
        end += below.count_ones() as usize;
        count += here.count_ones() as usize;
    }
    &leaves[..count]
}

#[inline(always)]
fn of_lane(columns: &[Column; 3], lane: usize) -> [f32; 3] {
    [columns[0][lane], columns[1][lane], columns[2][lane]]
}

/// Tests rays against the boxes of nodes.
struct Slabs {
    inverse: [Column; 3],
    /// For each axis the bound met first, the lower or the upper, and the bound met last.
    near: [[u32; RAYS]; 3],
    far: [[u32; RAYS]; 3],
}

impl Slabs {
    #[inline(always)]
    fn new<S: Simd>(simd: S, rays: &PacketRays) -> Self {
        let wide = simd.sixteen();
        let steepest = S::Sixteen::splat(wide, STEEPEST);
        let least = S::Sixteen::splat(wide, 1.0 / STEEPEST);
        let mut slabs = Self { inverse: [[0.0; RAYS]; 3], near: [[0; RAYS]; 3], far: [[0; RAYS]; 3] };
        let direction = load3(simd, &rays.direction);
        for k in 0..3 {
            let inverse = S::Sixteen::splat(wide, 1.0) / direction[k];
            steepest.where_or(direction[k].abs().lt(least), inverse).store(&mut slabs.inverse[k]);
            for lane in 0..RAYS {
                let back = slabs.inverse[k][lane] < 0.0;
                slabs.near[k][lane] = k as u32 + if back { 3 } else { 0 };
                slabs.far[k][lane] = k as u32 + if back { 0 } else { 3 };
            }
        }
        slabs
    }

    /// The ranges at which a ray enters and leaves each child's box; reversed for a miss.
    #[inline(always)]
    fn through<S: Simd>(&self, simd: S, rays: &PacketRays, lane: usize, node: &Node) -> (S::Eight, S::Eight) {
        let eight = simd.eight();
        let (x, far_x) = self.met(simd, rays, lane, node, 0);
        let (y, far_y) = self.met(simd, rays, lane, node, 1);
        let (z, far_z) = self.met(simd, rays, lane, node, 2);
        let slack = S::Eight::splat(eight, SLACK_M);
        let enter = x.max(y).max(z.max(S::Eight::splat(eight, rays.from_m[lane]))) - slack;
        let leave = far_x.min(far_y).min(far_z.min(S::Eight::splat(eight, rays.to_m[lane]))) + slack;
        (enter, leave)
    }

    #[inline(always)]
    fn met<S: Simd>(
        &self,
        simd: S,
        rays: &PacketRays,
        lane: usize,
        node: &Node,
        axis: usize,
    ) -> (S::Eight, S::Eight) {
        let eight = simd.eight();
        let (near, far) = (self.near[axis][lane] as usize, self.far[axis][lane] as usize);
        let origin = S::Eight::splat(eight, rays.origin_m[axis][lane]);
        let inverse = S::Eight::splat(eight, self.inverse[axis][lane]);
        let near = (S::Eight::load(eight, &node.bounds[near]) - origin) * inverse;
        (near, (S::Eight::load(eight, &node.bounds[far]) - origin) * inverse)
    }
}

/// Every crossing: the ray, the leaf, the disc in it, the range.
pub(crate) struct Each<F>(pub(crate) F);

impl<F: FnMut(usize, usize, usize, f32)> Search for Each<F> {
    #[inline(always)]
    fn take<S: Simd>(
        &mut self,
        _: S,
        lane: usize,
        leaf: usize,
        ranges_m: S::Sixteen,
        hits: <S::Sixteen as Lanes>::Mask,
    ) {
        each_hit(ranges_m, hits, |disc, range_m| (self.0)(lane, leaf, disc, range_m));
    }
}

/// The hit discs of a leaf, with their ranges.
#[inline(always)]
pub(crate) fn each_hit<L: Lanes>(ranges_m: L, hits: L::Mask, mut hit: impl FnMut(usize, f32)) {
    let mut hits = hits.bits();
    if hits != 0 {
        let mut ranges = [0.0; LEAF_DISCS];
        ranges_m.store(&mut ranges);
        while hits != 0 {
            let disc = hits.trailing_zeros() as usize % LEAF_DISCS;
            hits &= hits - 1;
            hit(disc, ranges[disc]);
        }
    }
}
