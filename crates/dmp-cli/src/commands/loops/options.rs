//! How maps are put together, as asked.

use dmp_loops::MapOptions;

use crate::options::{Asked, graph as graph_options};

/// How maps are put together.
pub(in crate::commands::loops) fn map_options(asked: &Asked) -> MapOptions {
    let usual = MapOptions::default();
    let rays_per_keyframe = asked.get(&graph_options::RAYS).unwrap_or(usual.rays_per_keyframe);
    MapOptions { rays_per_keyframe, moved_m: asked.get(&graph_options::MOVED) }
}
