//! One LAS or LAZ file in world coordinates, with the trajectory it was made with.
#![no_main]

use dmp_log::{LogOptions, MadeWith};
use dmp_sensor::{Isometry3, Trajectory};

fn options() -> LogOptions {
    let pose = |s: i64| (s * 1_000_000_000, Isometry3::translation(s as f64, 0.0, 0.0));
    let run = Trajectory::stamped((0..=20).map(pose).collect()).expect("a trajectory").trajectory;
    LogOptions { made_with: Some(MadeWith::new(run)), ..LogOptions::default() }
}

dmp_fuzz::file_target!("world.laz", |path| read_log(path, &options()));
