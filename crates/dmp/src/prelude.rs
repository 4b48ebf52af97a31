//! Everything that a program which scores logs needs, in one `use`.
//!
//! Re-exports from this crate, and from the crates below it what opens logs ([`open_log`], [`MemoryLog`]) and
//! what runs are made of ([`Trajectory`], [`Scan`], [`Isometry3`]).
//!
//! ```
//! use dmp::prelude::*;
//!
//! /// What a sensor `x` metres along a hall sees of it: 24 m long, 10 m wide, 5 m high.
//! fn scan(k: i64, x: f32) -> Scan {
//!     let mut points_in_sensor_m = Vec::new();
//!     for i in 0..40 {
//!         for j in 0..40 {
//!             // The sides of a cube, seen from its middle, each point moved out to the wall, floor or ceiling behind it.
//!             let (u, v) = (i as f32 / 20.0 - 0.975, j as f32 / 20.0 - 0.975);
//!             for d in [[1.0, u, v], [-1.0, u, v], [u, 1.0, v], [u, -1.0, v], [u, v, 1.0], [u, v, -1.0]] {
//!                 let end_m = if d[0] > 0.0 { 12.0 - x } else { 12.0 + x };
//!                 let stretch = [end_m / d[0].abs(), 5.0 / d[1].abs(), 2.5 / d[2].abs()];
//!                 let out = stretch.into_iter().fold(f32::INFINITY, f32::min);
//!                 points_in_sensor_m.push(d.map(|c| c * out));
//!             }
//!         }
//!     }
//!     Scan { stamp_ns: Some(k * 100_000_000), points_in_sensor_m, time_offsets_ns: Vec::new() }
//! }
//!
//! // Forty scans, and two trajectories: where the sensor was, and one that sways 20 cm to either side.
//! let x_m = |k: i64| k as f64 * 0.4 - 8.0;
//! let log = MemoryLog::new("hall", (0..40).map(|k| scan(k, x_m(k) as f32)).collect())?;
//! let trajectory = |sway_m: f64| {
//!     let y_m = |k| if k % 2 == 0 { sway_m } else { -sway_m };
//!     let pose = |k| (k * 100_000_000, Isometry3::translation(x_m(k), y_m(k), 0.0));
//!     Trajectory::stamped((0..40).map(pose).collect())
//! };
//! let runs = [
//!     Run::new("still", trajectory(0.0)?.trajectory),
//!     Run::new("swaying", trajectory(0.2)?.trajectory),
//! ];
//!
//! let report = evaluate(&log, &runs, &Config::default(), ())?;
//! assert_eq!(report.order, ["still", "swaying"]);
//! assert_eq!(report.verdict_between("still", "swaying").and_then(Verdict::better), Some("still"));
//! let score_m2 = report.score_of("still", Basis::CrossValidated, 0.5);
//! assert!(score_m2.is_some_and(|m2| m2.sqrt() < 0.1));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub use crate::{
    Basis, Best, Config, EvaluateError, MapSource, Note, Progress, Report, Run, Sink, Stage, Verdict, Watch,
    evaluate,
};
pub use dmp_log::{LogOptions, MemoryLog, ScanLog, open_log, read_trajectory};
pub use dmp_sensor::{Isometry3, Scan, Trajectory};
