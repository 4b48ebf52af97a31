//! Tests of the readers and writers on whole files.
#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod calib;
mod cloud;
mod common;
mod conformance;
mod csv;
mod depth;
mod depth_png;
mod folder;
mod forged;
mod g2o;
mod in_threads;
mod las_log;
mod loop_lists;
mod mcap_damage;
mod mcap_messages;
mod memory_log;
mod mesh;
mod mutation;
mod npy;
mod parts;
mod pcd;
mod point_time;
mod pose_graph;
mod real_data;
mod redwood;
mod residuals;
mod round_trip;
mod row_18;
mod scan_folder;
mod scan_folder_rows;
mod topics;
mod trajectory;
