//! What is drawn on the ground: maps, ways, the worst places, drift.

pub(super) mod cloud;
pub(super) mod drift;
pub(super) mod maps;
mod overlay;
pub(super) mod places;
pub(super) mod trajectories;

pub(crate) use places::times;
