//! Casts rays within each tile.

use dmp_map::{MapError, TileId};

use crate::answers::{First, Three};
use crate::discs::discs;
use crate::journey::{JourneyBuffers, Traveller, Wait};
use crate::lanes::Simd;
use crate::query::{Answer, Hit, HitDisc, Wanted};
use crate::rays::Rays;
use crate::within::{
    CastPackets, CastTile, Frustum, LEAST_RAYS, PACKETS, PacketAnswers, PacketLists, RAYS, SQUARES_PER_RAY,
    SearchLists, SearchRays, TileView, Visit,
};

/// How rays are grouped in a tile. No answer depends on it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Grouping {
    /// Packets where they are faster, else single rays.
    #[default]
    Auto,
    /// Every ray by itself.
    Single,
    /// Packets wherever there are three rays.
    Packets,
}

impl Grouping {
    /// The limit of [`Frustum::is_within`].
    fn squares_per_ray(self) -> u32 {
        match self {
            Self::Auto => SQUARES_PER_RAY,
            Self::Single => 0,
            Self::Packets => u32::MAX,
        }
    }
}

/// Per-thread buffers of a caster.
#[derive(Debug, Default)]
pub struct CastBuffers {
    pub(crate) journey: JourneyBuffers,
    pub(crate) lists: Lists,
}

#[derive(Debug, Default)]
pub(crate) struct Lists {
    visits: Box<[Visit; PACKETS]>,
    /// The visits' previous answers.
    before: Box<[PacketAnswers; PACKETS]>,
    /// The end of each visit's rays in the tile.
    ends: [[f32; RAYS]; PACKETS],
    /// The rays that are still active.
    lanes: [u32; PACKETS],
    of_packets: PacketLists,
    of_rays: SearchLists,
}

/// Answers every query: its work in each tile, and at the end.
pub(crate) struct Casting<'a> {
    pub(crate) grouping: Grouping,
    pub(crate) wanted: Wanted,
    /// One per query.
    pub(crate) answers: &'a mut [Answer],
    /// The discs of the crossings of a kind, if requested: one per query.
    pub(crate) discs: Option<(Hit, &'a mut [Option<HitDisc>])>,
    pub(crate) lists: &'a mut Lists,
}

impl Traveller for Casting<'_> {
    type Tile = CastTile;

    #[inline(always)]
    fn visit<S: Simd>(
        &mut self,
        simd: S,
        _: TileId,
        tile: &CastTile,
        packets: &mut [Rays],
        waits: &[Wait],
    ) -> Result<(), MapError> {
        let tile = &tile.view();
        for waits in waits.chunks(PACKETS) {
            visit_tile(simd, tile, packets, waits, self.grouping, self.wanted, self.lists);
            if let Some((hit, of_queries)) = &mut self.discs {
                take_discs(simd, tile, packets, waits, (*hit, of_queries), self.lists);
            }
        }
        Ok(())
    }

    #[inline(always)]
    fn arrive(&mut self, packets: &[Rays]) {
        for (k, rays) in packets.iter().enumerate() {
            if let Some(next) = packets.get(k + 1) {
                next.fetch_answers(self.answers);
            }
            rays.answer(self.answers);
        }
    }
}

/// Updates the answers of packets with a tile's surfels: up to [`PACKETS`] at a time.
#[inline(always)]
fn visit_tile<S: Simd>(
    simd: S,
    tile: &TileView,
    packets: &mut [Rays],
    waits: &[Wait],
    grouping: Grouping,
    wanted: Wanted,
    lists: &mut Lists,
) {
    for (k, wait) in waits.iter().enumerate() {
        let (rays, visit) = (&packets[wait.packet as usize], &mut lists.visits[k]);
        let asked = rays.asked();
        (visit.independence, visit.revisit) = (asked.independence, asked.revisit);
        lists.ends[k] = rays.in_tile(tile.origin_in_world_m, &mut visit.rays);
        rays.answers_in_tile(&mut lists.before[k]);
        visit.answers.clone_from(&lists.before[k]);
        lists.lanes[k] = visit.rays.limit_to(simd, wait.lanes);
    }
    let squares_per_ray = grouping.squares_per_ray();
    cast_visits::<S, false>(simd, tile, waits.len(), squares_per_ray, wanted, lists);
    // The input of a ray beside its place in the tile.
    for (k, wait) in waits.iter().enumerate() {
        let visit = &mut lists.visits[k];
        lists.lanes[k] = visit.go_beyond(simd, lists.lanes[k], wait.lanes, &lists.ends[k]);
    }
    cast_visits::<S, true>(simd, tile, waits.len(), squares_per_ray, wanted, lists);
    for (k, wait) in waits.iter().enumerate() {
        packets[wait.packet as usize].take(wait.lanes, &lists.before[k], &lists.visits[k].answers);
    }
}

/// Casts the first visits, together where that is faster. `BEYOND`: the rays begin where they may be far apart, beyond
/// the places in which revisits are detected.
#[inline(always)]
fn cast_visits<S: Simd, const BEYOND: bool>(
    simd: S,
    tile: &TileView,
    count: usize,
    squares_per_ray: u32,
    wanted: Wanted,
    lists: &mut Lists,
) {
    let Lists { visits, lanes, of_packets, of_rays, .. } = lists;
    let mut together = 0;
    for (k, (visit, &lanes)) in visits[..count].iter_mut().zip(&*lanes).enumerate() {
        let rays = lanes.count_ones();
        if squares_per_ray > 0 && rays >= LEAST_RAYS {
            let frustum = Frustum::around(simd, &visit.rays, lanes, tile.radius_m);
            let pays = |frustum: &Frustum| frustum.is_within(squares_per_ray, rays, tile.radius_m);
            if let Some(frustum) = frustum.filter(pays) {
                visit.frustum = frustum;
                together |= 1 << k;
            }
        }
    }
    if together != 0 {
        let lists = of_packets;
        match wanted {
            Wanted::First => simd.run(CastPackets::<false, BEYOND> { tile, visits, together, lists }),
            Wanted::Three => simd.run(CastPackets::<true, BEYOND> { tile, visits, together, lists }),
        }
    }
    for (k, (visit, &lanes)) in visits[..count].iter_mut().zip(&*lanes).enumerate() {
        if together >> k & 1 == 0 {
            search_alone(simd, tile, visit, lanes, wanted, of_rays);
        }
    }
}

/// Stores the discs of crossings of a kind that were found in the last tile visited.
#[inline(always)]
fn take_discs<S: Simd>(
    simd: S,
    tile: &TileView,
    packets: &[Rays],
    waits: &[Wait],
    (hit, of_queries): (Hit, &mut [Option<HitDisc>]),
    lists: &mut Lists,
) {
    let Lists { visits, before, of_rays, .. } = lists;
    for ((wait, visit), before) in waits.iter().zip(visits.iter_mut()).zip(before.iter()) {
        let rays = &packets[wait.packet as usize];
        let found = discs(simd, tile, visit, before, (hit, wait.lanes), of_rays);
        for (lane, disc) in found.into_iter().enumerate() {
            if disc.is_some() {
                of_queries[rays.query(lane)] = disc;
            }
        }
    }
}

/// Casts some rays of a visit one by one.
#[inline(always)]
fn search_alone<S: Simd>(
    simd: S,
    tile: &TileView,
    visit: &mut Visit,
    lanes: u32,
    wanted: Wanted,
    lists: &mut SearchLists,
) {
    if lanes == 0 {
        return;
    }
    let Visit { rays, answers, independence, revisit, .. } = visit;
    match wanted {
        Wanted::First => {
            for lane in 0..RAYS {
                rays.to_m[lane] = rays.to_m[lane].min(answers.first_m[lane]);
            }
            let found = &mut First(&mut answers.first_m);
            simd.run(SearchRays { tile, rays, lanes, found, lists });
        }
        Wanted::Three => {
            let found = &mut Three::new(tile, rays, [*independence, *revisit], answers);
            simd.run(SearchRays { tile, rays, lanes, found, lists });
        }
    }
}
