//! Fuses a map from a log and casts your own rays into it:
//! `cargo run --release -p dmp-slam --example cast -- [LOG RUN.tum]`.

use std::error::Error;
use std::path::Path;

use dmp::fuse_maps;
use dmp::prelude::*;
use dmp_cast::{CastBuffers, CastSettings, Caster, Query};
use dmp_sensor::Ray;
use dmp_sensor::Vector3;

const SAMPLES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data-samples");

fn main() -> Result<(), Box<dyn Error>> {
    let mut files = std::env::args().skip(1);
    let log = files.next().unwrap_or_else(|| format!("{SAMPLES}/town.mcap"));
    let trajectory = files.next().unwrap_or_else(|| format!("{SAMPLES}/truth.tum"));
    let log = open_log(Path::new(&log), &LogOptions::default())?;
    let trajectory = read_trajectory(Path::new(&trajectory))?.trajectory;
    let here = *trajectory.poses().first().ok_or("no pose")?;

    // The maps are on disk as long as `maps` lives; `Config::save_maps` keeps them.
    let runs = [Run::new("mine", trajectory)];
    let maps = fuse_maps(log.as_ref(), &runs, &Config::default(), ())?;
    let (name, map) = maps.iter().next().ok_or("no map")?;
    println!("{name}: {} surfels in {} tiles", map.surfels(), map.entries().count());
    // A map is in its run's canonical frame. It knows the transform to the trajectory's own frame.
    let world_from_sensor = map.own_from_world().inverse() * here;

    // Rays from the first pose: ahead, left, back, right, down.
    let directions = [Vector3::x(), Vector3::y(), -Vector3::x(), -Vector3::y(), -Vector3::z()];
    let ray = |direction_in_sensor: &Vector3<f64>| Query {
        ray: Ray {
            origin_in_world: world_from_sensor.translation.vector.into(),
            direction_in_world: (world_from_sensor.rotation * direction_in_sensor).into(),
            // The measured range, if there is one: the nearest crossing to it is returned too.
            range_m: 10.0,
        },
        segment: None,
    };
    let queries: Vec<Query> = directions.iter().map(ray).collect();
    // Limit for the part of the map in memory, bytes.
    let caster = Caster::new(map, CastSettings::default(), 256 << 20);
    let mut answers = Vec::new();
    caster.cast(&queries, &mut answers, &mut CastBuffers::default())?;
    for (direction, answer) in ["ahead", "left", "back", "right", "down"].into_iter().zip(&answers) {
        match answer.first_m {
            Some(range_m) => println!("{direction:5}: {range_m:.2} m"),
            None => println!("{direction:5}: nothing"),
        }
    }
    Ok(())
}
