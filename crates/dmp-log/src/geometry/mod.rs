//! Points and triangles in files.

pub(crate) mod cloud;
mod laz;
mod mesh;
pub(crate) mod pcd;
mod unit;

pub use cloud::{
    CloudFormat, CloudSummary, CloudWriter, CrsError, LAS_REACH_M, MetricCrs, OrientedPoint, read_cloud,
};
pub use mesh::{MeshFormat, MeshSummary, is_mesh, read_mesh};
pub use unit::LengthUnit;
