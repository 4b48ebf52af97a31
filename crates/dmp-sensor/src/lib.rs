//! What a LiDAR or a depth camera measured, from where and when.
//!
//! # Brief overview
//! A [`Scan`] is one sweep of the sensor: points in the *sensor* frame, perhaps with a time for each.
//! A [`Trajectory`] says where the *body* was in the *world* at certain instants; a [`Track`] puts the
//! extrinsic `body_from_sensor` behind it and interpolates any instant in between, never outside.
//! Together they turn returns into [`Ray`]s: the range–bearing model, in which a return is a measured
//! range along a bearing, from the sensor's place at the return's own time. A [`PinholeCamera`] makes such points
//! of depth images, and says what a depth is to a range. A [`ReturnFilter`] says which
//! returns are used and [`ReturnCounts`] where the others went. A [`PoseGraph`] is a trajectory with the
//! measurements that it was made of.
//!
//! Nothing here reads a file or starts a thread. Lengths are metres, instants integer nanoseconds,
//! world coordinates `f64`. The bits of every result are the same on every platform.
//!
//! ```
//! use dmp_sensor::{Isometry3, Ray, Track, Trajectory};
//!
//! let here = Isometry3::translation(0.0, 0.0, 0.0);
//! let there = Isometry3::translation(10.0, 0.0, 0.0);
//! let run = Trajectory::stamped(vec![(0, here), (1_000_000_000, there)])?.trajectory;
//! let track = Track::new(&run, Isometry3::identity(), 2_000_000_000);
//! let world_from_sensor = track.world_from_sensor_at(500_000_000).expect("within the trajectory");
//! let ray = Ray::of_return(&world_from_sensor, [0.0, 4.0, 0.0]);
//! assert_eq!((ray.origin_in_world[0], ray.range_m), (5.0, 4.0));
//! # Ok::<(), dmp_sensor::TrajectoryError>(())
//! ```

mod along;
mod between;
mod camera;
mod carried;
mod ego;
mod gradient;
mod pose_graph;
mod ray;
mod returns;
mod scan;
mod seven;
mod track;
mod trajectory;
mod travel;

pub use along::along_m;
pub use between::pose_between;
pub use camera::{CameraError, DepthNoise, Distortion, PinholeCamera, PixelBearings, depth_per_range};
pub use ego::{EgoMask, EgoVotes};
pub use gradient::{Gradient, Plane, PosedReturn, ResidualKind, by_motion, moved_by, point_to_plane};
pub use nalgebra::{
    Isometry3, Matrix3, Matrix6, Point3, Quaternion, Rotation3, Translation3, UnitQuaternion, Vector3,
    Vector6,
};
pub use pose_graph::{Component, Disconnected, EdgeFault, PoseEdge, PoseGraph, PoseGraphError};
pub use ray::Ray;
pub use returns::{DropReason, ReturnCounts, ReturnFilter, is_implausible};
pub use scan::Scan;
pub use seven::{RotationError, nearest_rotation, seven, transform_of};
pub use track::{Track, TrackCursor};
pub use trajectory::{Trajectory, TrajectoryError, TrajectoryRepairs};
