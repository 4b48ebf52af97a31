//! Simulated towns, rooms, sensors, drives and SLAM errors with known truth.
//!
//! # Brief overview
//! A [`Town`] is made of a seed and answers one question: what is the first surface along a ray, at a certain
//! time? A [`Drive`] takes a body through its streets along a [`Route`] and knows its pose at every instant; on
//! a [campus](Town::campus) it is a walker who carries the sensor, up and down the stairs.
//! A [`Lidar`] on that body measures scans, each firing from where the sensor is at that moment. A
//! [`Recording`] ties the three together: scans in order, and the truth. [`SlamErrors`] turn a true
//! trajectory into one that a SLAM system might have put out, with errors of known kind and size. A [`LoopGraph`] is what a SLAM
//! front end might have left of it: a pose graph that drifts, and loop candidates, true and false.
//!
//! Indoors, a [`Room`] is furnished of a seed, a [`RoomWalk`] takes a hand-held camera through it, and a
//! [`DepthRecording`] is what that camera measures: depth images with the noise and the holes of a Kinect.
//! [`room_estimates`] are five trajectories from good ones to a collapsed one.
//!
//! The same numbers give the same scans and trajectories, to the bit, on any machine and any number of
//! threads. Nothing here reads or writes a file. World frame: x east, y north, z up; body and sensor frame
//! are one: x ahead, y left, z up; a camera has z ahead, x right, y down.
//!
//! ```
//! use dmp_sim::{LidarOptions, Recording, RecordingOptions, Route, SlamErrors, ate_rmse_m, close_loop};
//!
//! let lidar = LidarOptions { azimuth_steps: 60, rate_hz: 2.0, ..LidarOptions::with_beams(16) };
//! let options = RecordingOptions { seed: 1, scans: 20, route: Route::Loop, speed_m_s: 5.0, traffic: 0, lidar };
//! let town = options.town()?;
//! let recording = Recording::new(&town, &options)?;
//! assert!(recording.scans().all(|scan| scan.len() > 400));
//!
//! let truth = recording.drive().trajectory(20.0)?;
//! let wrong = SlamErrors { drift_ate_m: Some(0.5), ..SlamErrors::default() }.apply(&truth)?;
//! assert!((ate_rmse_m(&wrong, &truth) - 0.5).abs() < 0.005);
//! # Ok::<(), dmp_sim::SimError>(())
//! ```

mod city;
mod company;
mod error;
mod errors;
mod lidar;
mod lidar_options;
mod loops;
mod parts;
mod random;
mod room;
mod route;
mod simulation;
mod town;
mod ways;

pub use city::{CityOptions, CityRecording};
pub use company::Companion;
pub use dmp_lengths::Scales;
pub use error::SimError;
pub use errors::{Noise, SlamErrors, ate_rmse_m, close_loop};
pub use lidar::Lidar;
pub use lidar_options::{LidarOptions, NoReturn, Sweep};
pub use loops::{LoopGraph, LoopGraphOptions, LoopKind, SimulatedLoop};
pub use parts::solid::{Hit, Surface};
pub use room::{
    DepthImage, DepthRecording, DepthRecordingOptions, Room, RoomEstimate, RoomHit, RoomOptions, RoomWalk,
    RoomWalkOptions, room_estimates,
};
pub use route::Route;
pub use simulation::{Recording, RecordingOptions};
pub use town::{Scenery, Town, TownOptions};
pub use ways::{Drive, DriveOptions};
