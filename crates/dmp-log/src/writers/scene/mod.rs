//! A scene of runs for viewers: maps, ways, poses, returns, worst places, in one MCAP file.

mod cloud;
#[cfg(test)]
mod tests;
mod writer;

pub use cloud::{SceneCloud, ScenePoint};
pub use writer::{SceneHead, ScenePlace, SceneRun, SceneWriter};
