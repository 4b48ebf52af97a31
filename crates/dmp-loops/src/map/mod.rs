//! The map of a graph, made of rigid patches, one around each keyframe.

mod build;
mod changed;
mod rays;
mod score;
mod sums;
#[cfg(test)]
mod tests;

pub use build::{LoopMap, MapOptions};
pub use score::MapScores;
pub(crate) use score::Placed;

use dmp_map::Placement;
use dmp_sensor::Isometry3;

/// Where the patch of a keyframe lies.
fn placement(world_from_body: &Isometry3<f64>) -> Placement {
    let rotation = world_from_body.rotation.to_rotation_matrix();
    Placement {
        rotation: std::array::from_fn(|i| std::array::from_fn(|j| rotation[(i, j)])),
        origin_in_world_m: world_from_body.translation.vector.into(),
    }
}
