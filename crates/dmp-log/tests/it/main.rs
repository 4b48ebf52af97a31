//! Tests of the readers and writers on whole files. `fuzz/` includes them for their good files and readers.
#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod as_read;
mod bag_faults;
mod calib;
pub(crate) mod cloud;
pub(crate) mod common;
mod conformance;
mod csv;
#[path = "../../../../fuzz/damage/mod.rs"]
#[allow(dead_code, reason = "`cargo xtask attack` and the fuzz target use more of it")]
pub(crate) mod damage;
mod depth;
pub(crate) mod depth_png;
mod folder;
pub(crate) mod las_log;
mod loop_lists;
mod mcap_damage;
mod mcap_messages;
mod memory_log;
pub(crate) mod mesh;
pub(crate) mod mutation;
mod npy;
pub(crate) mod parts;
pub(crate) mod pcd;
mod point_time;
mod pose_graph;
mod real_data;
mod residuals;
pub(crate) mod ros1;
mod ros1_bag;
mod round_trip;
pub(crate) mod scan_folder;
mod scan_folder_rows;
pub(crate) mod topics;
mod trajectory;
