//! Furnished rooms, hand-held depth cameras in them, and SLAM estimates of where the cameras were.

mod estimates;
mod fitting;
mod furnish;
mod furnished;
mod furniture;
mod image;
mod noise;
mod plan;
mod recording;
mod surface;
#[cfg(test)]
mod tests;
mod view;
mod walk;
mod walls;

pub use estimates::{RoomEstimate, room_estimates};
pub use furnished::{Room, RoomHit};
pub use image::DepthImage;
pub use plan::RoomOptions;
pub use recording::{DepthRecording, DepthRecordingOptions};
pub use walk::{RoomWalk, RoomWalkOptions};
