//! Scan logs as one LAS or LAZ file of a mobile mapper: points in world coordinates, each with a time.
//!
//! A return is a range along a bearing from the sensor; a point in the world is neither. The trajectory that
//! the file was made with gives both back: `p_sensor = sensor_from_world(t) p_world`.

mod clock;
mod cuts;
mod log;
mod made_with;

pub(crate) use log::LasLog;
pub use made_with::MadeWith;
