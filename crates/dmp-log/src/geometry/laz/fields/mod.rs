//! The fields of points: how each is compressed.

mod gps_time;
pub(crate) mod items;
mod point10;
mod point14;
pub(crate) mod record;
mod returns;
mod skipped;
mod version1;

pub(crate) use gps_time::GpsTimes;
pub(crate) use items::{Compression, Cutting, Item, ItemKind, PointsHead};
pub(crate) use point10::Point10;
pub(crate) use point14::{GPS_TIME_LAYER, Point14, XY_LAYER, Z_LAYER};
pub(crate) use record::{GPS_TIME_10, GPS_TIME_14};
pub(crate) use skipped::Skipped;
pub(crate) use version1::{GpsTimesVersion1, Point10Version1};
