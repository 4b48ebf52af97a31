//! Traverses all tiles with many rays, on one instruction path.

use std::sync::Arc;

use dmp_map::{MapError, TileExtent, TileId};

use crate::lanes::{Simd, fetch};
use crate::order::Order;
use crate::query::{CastSettings, Query};
use crate::rays::Rays;

/// Packets in flight at once: their state stays in a core's own cache.
const SECTION_PACKETS: usize = 64;

/// The tiles that rays traverse.
pub(crate) trait Tiles {
    type Tile;
    fn edge_m(&self) -> f64;
    fn bounds(&self) -> Option<[TileId; 2]>;
    fn extent(&self, tile: TileId) -> Option<TileExtent>;
    fn load(&self, tile: TileId) -> Result<Arc<Self::Tile>, MapError>;
}

/// The work of rays along their way.
pub(crate) trait Traveller {
    type Tile;

    /// Some rays of some packets are in a tile.
    fn visit<S: Simd>(
        &mut self,
        simd: S,
        id: TileId,
        tile: &Self::Tile,
        packets: &mut [Rays],
        waits: &[Wait],
    ) -> Result<(), MapError>;

    /// All rays of some packets have ended.
    fn arrive(&mut self, packets: &[Rays]);
}

/// Rays of a packet that enter a tile.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Wait {
    pub(crate) tile: TileId,
    pub(crate) packet: u32,
    /// A bit for each ray.
    pub(crate) lanes: u32,
}

/// Per-thread buffers of [`travel`].
#[derive(Debug, Default)]
pub(crate) struct JourneyBuffers {
    pub(crate) order: Order,
    packets: Vec<Rays>,
    /// Packets by the number of tiles they have passed, with the rays that enter the next.
    waiting: Vec<Vec<Wait>>,
}

/// Traverses the tiles with all queries, in the order of the buffers, nearest tiles first. Rays enter a tile together
/// if they reach it after the same number of tiles.
#[inline(always)]
pub(crate) fn travel<S: Simd, T: Tiles>(
    simd: S,
    tiles: &T,
    settings: &CastSettings,
    queries: &[Query],
    buffers: &mut JourneyBuffers,
    traveller: &mut impl Traveller<Tile = T::Tile>,
) -> Result<(), MapError> {
    let Some(bounds) = tiles.bounds() else { return Ok(()) };
    let JourneyBuffers { order, packets, waiting } = buffers;
    let edge_m = tiles.edge_m();
    let mut looked_up: (TileId, Option<TileExtent>) = (bounds[0], tiles.extent(bounds[0]));
    let mut extent_of = |tile: TileId| {
        if tile != looked_up.0 {
            looked_up = (tile, tiles.extent(tile));
        }
        looked_up.1
    };
    let mut start = 0;
    while start < order.len() {
        waiting.iter_mut().for_each(Vec::clear);
        let mut count = 0;
        while start < order.len() && count < SECTION_PACKETS {
            let mut packet = order.packet(start);
            // All rays of a packet have one segment.
            let segment = |entry: u64| queries[entry as u32 as usize].segment;
            if let Some(other) = packet.iter().position(|&entry| segment(entry) != segment(packet[0])) {
                packet = &packet[..other];
            }
            if packets.len() == count {
                packets.push(Rays::EMPTY);
            }
            let rays = &mut packets[count];
            order.after_packet(start).iter().for_each(|&entry| fetch(&queries[entry as u32 as usize]));
            rays.fill(queries, packet, settings, edge_m);
            let go = |tile, steps, lanes| wait(waiting, steps, Wait { tile, packet: count as u32, lanes });
            rays.route(rays.lanes(), edge_m, bounds, &mut extent_of, go);
            count += 1;
            start += packet.len();
        }
        let mut steps = 0;
        while steps < waiting.len() {
            let mut list = std::mem::take(&mut waiting[steps]);
            list.sort_unstable();
            for waits in list.chunk_by(|a, b| a.tile == b.tile) {
                let tile = tiles.load(waits[0].tile)?;
                traveller.visit(simd, waits[0].tile, &tile, packets, waits)?;
                for visit in waits {
                    let rays = &mut packets[visit.packet as usize];
                    let lanes = rays.unsettled() & visit.lanes;
                    if lanes != 0 {
                        let go = |tile, steps, lanes| wait(waiting, steps, Wait { tile, lanes, ..*visit });
                        rays.leave_tile(lanes, edge_m);
                        rays.route(lanes, edge_m, bounds, &mut extent_of, go);
                    }
                }
            }
            list.clear();
            waiting[steps] = list;
            steps += 1;
        }
        traveller.arrive(&packets[..count]);
    }
    Ok(())
}

#[inline(always)]
fn wait(waiting: &mut Vec<Vec<Wait>>, steps: usize, wait: Wait) {
    if waiting.len() <= steps {
        waiting.resize_with(steps + 1, Vec::new);
    }
    waiting[steps].push(wait);
}
