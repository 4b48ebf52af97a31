//! Casting within one tile: its tree, one ray by itself or sixteen at once.

mod build;
mod crossing;
mod frustum;
mod lists;
mod packet;
mod packet_rays;
mod search;
mod tile;

pub(crate) use frustum::{Frustum, LEAST_RAYS, SQUARES_PER_RAY};
pub(crate) use packet::{CastPackets, PACKETS, PacketAnswers, PacketLists, Visit};
pub(crate) use packet_rays::{Column, PacketRays, RAYS};
pub(crate) use search::{Each, Search, SearchLists, SearchRays, each_hit};
pub use tile::CastTile;
pub(crate) use tile::{LEAF_DISCS, Node, TileView};
