//! Point clouds given as maps.

mod batches;
mod e57_cloud;
mod format;
mod las_cloud;
pub(crate) mod las_crs;
pub(crate) mod las_header;
pub(crate) mod las_points;
pub(crate) mod las_units;
mod oriented;
mod pcd_cloud;
pub(crate) mod ply_cloud;
pub(crate) mod ply_header;
mod read;
pub(crate) mod table;
mod wkt;

pub use format::CloudFormat;
pub use oriented::{CloudWriter, OrientedPoint};
pub use read::{CloudSummary, read_cloud};
pub use table::LAS_REACH_M;
pub use wkt::{CrsError, MetricCrs};
