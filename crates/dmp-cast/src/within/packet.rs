//! Casts sixteen rays at once within a tile.

use dmp_map::Independence;

use super::crossing::{MIN_COS, plane_crossing};
use super::frustum::Frustum;
use super::lists::grow_to;
use super::packet_rays::{Column, PacketRays, RAYS, load3};
use super::tile::{LEAF_DISCS, TileView, WIDTH};
use crate::lanes::{Job, Lanes, Mask, Simd, fetch};

/// The best answers so far; infinite without one, negatively infinite if the answer is final.
#[derive(Debug, Clone, Default)]
#[repr(align(64))]
pub(crate) struct PacketAnswers {
    pub(crate) first_m: Column,
    pub(crate) nearest_m: Column,
    /// |nearest − measured|; initially the half-width of the window.
    pub(crate) gap_m: Column,
    pub(crate) independent_m: Column,
    /// A bit for each ray.
    pub(crate) revisited: u32,
}

/// Packets processed in a tile at the same time.
pub(crate) const PACKETS: usize = 8;
/// Bits of a pair for the packet's number.
const PACKET_BITS: u32 = PACKETS.ilog2();

/// Leaves are prefetched this many steps ahead.
const LEAVES_AHEAD: usize = 4;

/// A packet in a tile.
#[derive(Debug, Clone, Default)]
pub(crate) struct Visit {
    pub(crate) rays: PacketRays,
    pub(crate) frustum: Frustum,
    pub(crate) answers: PacketAnswers,
    pub(crate) independence: Option<Independence>,
    pub(crate) revisit: Option<Independence>,
    /// Whether the rays beyond their places only search independent surfels.
    pub(crate) only_independent: bool,
}

impl Visit {
    /// Extends those rays of `lanes` to `ends_m` that may still change an answer there; rays in `done` start where they
    /// ended. Returns the extended rays.
    #[inline(always)]
    pub(crate) fn go_beyond<S: Simd>(&mut self, simd: S, done: u32, lanes: u32, ends_m: &Column) -> u32 {
        let wide = simd.sixteen();
        let load = S::Sixteen::load;
        let Self { rays, answers, .. } = self;
        let from = load(wide, &rays.to_m).where_or(S::Sixteen::mask_of(wide, done), load(wide, &rays.from_m));
        from.store(&mut rays.from_m);
        rays.to_m = *ends_m;
        let window = load(wide, &rays.measured_m) + load(wide, &answers.gap_m);
        let mut of_any = from.le(load(wide, &answers.first_m)) | from.le(window);
        if self.revisit.is_some() {
            let unseen = S::Sixteen::mask_of(wide, !answers.revisited);
            of_any = of_any | (unseen & from.lt(load(wide, &rays.place_m)));
        }
        let mut more = of_any;
        if self.independence.is_some() {
            more = more | from.le(load(wide, &answers.independent_m));
        }
        let lanes = rays.limit_to(simd, more.bits() & lanes);
        self.only_independent = of_any.bits() & lanes == 0;
        lanes
    }
}

/// Most discs that are buffered.
const ASIDE: usize = 16;

/// A disc that some ray hits, and the range of each hit: infinite for a miss.
#[derive(Debug, Clone, Copy, Default)]
#[repr(align(64))]
struct Hit {
    ranges_m: Column,
    disc: u32,
    /// A bit for each ray that hits it.
    lanes: u32,
}

/// Lists of [`CastPackets`], reused.
#[derive(Debug, Default)]
pub(crate) struct PacketLists {
    /// A node and a packet.
    nodes: Vec<u32>,
    /// A leaf and a packet.
    leaves: Vec<u32>,
    /// For each packet discs: sixteen times the leaf, plus the index in it.
    discs: [Vec<u32>; PACKETS],
    aside: [Hit; ASIDE],
}

/// Updates the answers of packets with all their crossings.
///
/// It has three steps, each one plain loop: nodes that meet the frustum of a packet give leaves, leaves give discs, and
/// every disc is tested with all rays. A single packet would wait at every node for the previous result. So several
/// packets alternate: lists are processed from the front and grow at the end.
pub(crate) struct CastPackets<'a, const THREE: bool, const BEYOND: bool> {
    pub(crate) tile: &'a TileView<'a>,
    pub(crate) visits: &'a mut [Visit; PACKETS],
    /// A bit for each visit to cast.
    pub(crate) together: u32,
    pub(crate) lists: &'a mut PacketLists,
}

impl<const THREE: bool, const BEYOND: bool> Job for CastPackets<'_, THREE, BEYOND> {
    type Output = ();

    #[inline(always)]
    fn on<S: Simd>(self, simd: S) {
        let Self { tile, visits, together, lists: PacketLists { nodes, leaves, discs, aside } } = self;
        if tile.nodes.is_empty() {
            return;
        }
        let leaves = gather_leaves::<S, BEYOND>(simd, tile, visits, together, nodes, leaves);
        let counts = gather_discs::<S, BEYOND>(simd, tile, visits, leaves, discs);
        for (k, visit) in visits.iter_mut().enumerate() {
            if together >> k & 1 == 1 {
                cross::<S, THREE, BEYOND>(simd, tile, visit, &discs[k][..counts[k]], aside);
            }
        }
    }
}

/// [`Independence::bounds`]; bounds that no surfel satisfies if nothing is independent.
#[inline(always)]
fn bounds_of(independence: Option<Independence>) -> [i32; 2] {
    independence.map_or([i32::MIN, i32::MAX], Independence::bounds)
}

#[inline(always)]
fn gather_leaves<'a, S: Simd, const BEYOND: bool>(
    simd: S,
    tile: &TileView,
    visits: &[Visit; PACKETS],
    together: u32,
    nodes: &mut Vec<u32>,
    leaves: &'a mut Vec<u32>,
) -> &'a [u32] {
    let eight = simd.eight();
    grow_to(nodes, RAYS);
    // Every packet starts at the root.
    S::Sixteen::pack_lanes(simd.sixteen(), 0, together, nodes);
    let (mut at, mut end, mut count) = (0, together.count_ones() as usize, 0);
    while at < end {
        grow_to(nodes, end + WIDTH);
        grow_to(leaves, count + WIDTH);
        let (index, packet) = ((nodes[at] >> PACKET_BITS) as usize, nodes[at] as usize % PACKETS);
        at += 1;
        let (node, visit) = (&tile.nodes[index], &visits[packet]);
        let mut inside = visit.frustum.children::<S, BEYOND>(simd, node);
        if let (true, true, Some(independence)) = (BEYOND, visit.only_independent, visit.independence) {
            inside &= node.may_hold(simd, independence).bits();
        }
        let (below, here) = (inside & !node.leaves, inside & node.leaves);
        let children = S::Eight::tagged(eight, &node.children, PACKET_BITS, packet as u32);
        S::Eight::pack(children, below, &mut nodes[end..]);
        S::Eight::pack(children, here, &mut leaves[count..]);
        end += below.count_ones() as usize;
        count += here.count_ones() as usize;
    }
    &leaves[..count]
}

/// Fills the lists of discs; returns their lengths.
#[inline(always)]
fn gather_discs<S: Simd, const BEYOND: bool>(
    simd: S,
    tile: &TileView,
    visits: &[Visit; PACKETS],
    leaves: &[u32],
    discs: &mut [Vec<u32>; PACKETS],
) -> [usize; PACKETS] {
    let mut counts = [0; PACKETS];
    for (k, &pair) in leaves.iter().enumerate() {
        if let Some(&later) = leaves.get(k + LEAVES_AHEAD) {
            let later = (later >> PACKET_BITS) as usize;
            // Also their normals and segments, for the remaining discs.
            fetch(&tile.leaves[later]);
            fetch(&tile.support[later]);
        }
        let (leaf, packet) = (pair >> PACKET_BITS, pair as usize % PACKETS);
        let (list, count) = (&mut discs[packet], &mut counts[packet]);
        grow_to(list, *count + LEAF_DISCS);
        let inside = visits[packet].frustum.discs::<S, BEYOND>(simd, &tile.leaves[leaf as usize]);
        S::Sixteen::pack_lanes(simd.sixteen(), leaf * LEAF_DISCS as u32, inside, &mut list[*count..]);
        *count += inside.count_ones() as usize;
    }
    counts
}

/// Tests every disc with all rays and buffers the hits; with three answers, only hits are compared with the best so
/// far. Two short loops keep their data in registers, one long loop would not. Hits are selected by masks and counts
/// instead of branches, which would be mispredicted half of the time.
#[inline(always)]
fn cross<S: Simd, const THREE: bool, const BEYOND: bool>(
    simd: S,
    tile: &TileView,
    visit: &mut Visit,
    discs: &[u32],
    aside: &mut [Hit; ASIDE],
) {
    let Visit { rays, answers, .. } = visit;
    let [independence, revisit] = [visit.independence, visit.revisit].map(bounds_of);
    let wide = simd.sixteen();
    let origin = load3::<S>(simd, &rays.origin_m);
    let direction = load3::<S>(simd, &rays.direction);
    let measured = S::Sixteen::load(wide, &rays.measured_m);
    let (from, to) = (S::Sixteen::load(wide, &rays.from_m), S::Sixteen::load(wide, &rays.to_m));
    let radius2 = S::Sixteen::splat(wide, tile.radius_m * tile.radius_m);
    let min_cos = S::Sixteen::splat(wide, MIN_COS);
    let infinite = S::Sixteen::splat(wide, f32::INFINITY);
    let place_m = S::Sixteen::load(wide, &rays.place_m);
    let mut first = S::Sixteen::load(wide, &answers.first_m);
    let mut nearest = S::Sixteen::load(wide, &answers.nearest_m);
    let mut gap = S::Sixteen::load(wide, &answers.gap_m);
    let mut independent = S::Sixteen::load(wide, &answers.independent_m);
    let mut revisited = answers.revisited;
    let place_of = |disc: u32| (disc as usize / LEAF_DISCS, disc as usize % LEAF_DISCS);
    for discs in discs.chunks(ASIDE) {
        let mut count = 0;
        for &disc in discs {
            let (leaf, place) = place_of(disc);
            let centre = S::Sixteen::splat3(wide, tile.leaves[leaf].disc(place, 0));
            let normal = S::Sixteen::splat3(wide, tile.leaves[leaf].disc(place, 3));
            let (range, cos, off2) = plane_crossing(origin, direction, centre, normal);
            let hits = min_cos.le(cos.abs()) & off2.le(radius2) & from.le(range) & range.le(to);
            // A miss is far from everything.
            let range = range.where_or(hits, infinite);
            if THREE {
                let hit = &mut aside[count % ASIDE];
                range.store(&mut hit.ranges_m);
                (hit.disc, hit.lanes) = (disc, hits.bits());
                count += usize::from(hit.lanes != 0);
            } else {
                first = range.min(first);
            }
        }
        for hit in aside.iter().take(count) {
            let (leaf, place) = place_of(hit.disc);
            let range = S::Sixteen::load(wide, &hit.ranges_m);
            first = range.min(first);
            let gap_here = (range - measured).abs();
            let nearer = gap_here.lt(gap) | (gap_here.equal(gap) & range.lt(nearest));
            nearest = range.where_or(nearer, nearest);
            gap = gap_here.where_or(nearer, gap);
            let [low, high] = tile.support[leaf].of(place);
            let holds = |[below, above]: [i32; 2]| u32::from(low < below || high > above).wrapping_neg();
            let counts = S::Sixteen::mask_of(wide, holds(independence));
            independent = range.where_or(counts & range.lt(independent), independent);
            // Rays that have not gone beyond their place end in it.
            let at_place = if BEYOND { hit.lanes & range.le(place_m).bits() } else { hit.lanes };
            revisited |= at_place & holds(revisit);
        }
    }
    first.store(&mut answers.first_m);
    if THREE {
        nearest.store(&mut answers.nearest_m);
        gap.store(&mut answers.gap_m);
        independent.store(&mut answers.independent_m);
        answers.revisited = revisited;
    }
}
