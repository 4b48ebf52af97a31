//! The map of a graph, made of rigid patches, one around each keyframe.

mod build;
mod changed;
mod rays;
mod score;
mod sums;
#[cfg(test)]
mod tests;

pub use build::{LoopMap, MapOptions};
pub(crate) use score::Placed;
pub use sums::MapScores;
