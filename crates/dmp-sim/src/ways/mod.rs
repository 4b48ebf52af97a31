//! Where vehicles and walkers go, and when.

mod drive;
pub(crate) mod motion;
pub(crate) mod path;
mod profile;
mod route_path;
mod sway;

pub use drive::{Drive, DriveOptions};
pub(crate) use motion::{
    FORWARD_M_S2, HEIGHT_M, MARGIN_S, SIDEWAYS_M_S2, START_NS, WAVER, pose_stamps_ns, require_speed,
};
pub(crate) use path::{Path, Piece, Station};
pub(crate) use route_path::{CORNER_M, corner, lane};
pub(crate) use sway::{Stance, Sway, Sways};
