//! Clouds of a scene: maps, coloured by how much they are off, and returns.

use std::collections::HashMap;

use dmp::Scales;
use dmp_draw::{SampledReturn, colour_of_residual, text};
use dmp_log::{SceneCloud, ScenePoint, SceneWriter};
use dmp_map::{OwnDisc, Store, TileId};
use dmp_sensor::{Point3, UnitQuaternion, Vector3};

use super::super::residuals::drawn;
use super::placed::Placed;
use crate::console::Hosted;

/// Surfels of a map at most.
const SURFELS: u64 = 1_000_000;
/// Surfels are as much off as the returns in their cube of so many metres of a drive.
const CUBE_M: f64 = 1.0;

/// How much is shown of how much.
#[derive(Debug, Default, Clone, Copy)]
pub(super) struct Shown {
    pub(super) shown: u64,
    pub(super) of: u64,
}

impl Shown {
    pub(super) fn add(&mut self, other: Self) {
        self.shown += other.shown;
        self.of += other.of;
    }

    pub(super) fn in_words(&self) -> String {
        let [shown, of] = [self.shown, self.of].map(text::count);
        if self.shown == self.of { format!("all {of}") } else { format!("{shown} of {of}") }
    }
}

/// How much returns are off, by cubes of the world of a run: how many there are, and the sum of their squares, cut off.
type Cubes = HashMap<[i32; 3], (u32, f32)>;

impl Placed<'_> {
    /// Writes the map of a run, one surfel of so many, evenly drawn.
    pub(super) fn write_map(
        &self,
        writer: &mut SceneWriter,
        run: usize,
        map: &Store,
        host: &Hosted,
    ) -> anyhow::Result<Shown> {
        let cubes = self.cubes(run, host)?;
        let mut tiles: Vec<(TileId, u64)> =
            map.entries().map(|entry| (entry.tile, u64::from(entry.own.surfels))).collect();
        tiles.sort_unstable();
        let of: u64 = tiles.iter().map(|(_, surfels)| surfels).sum();
        let every = of.div_ceil(SURFELS).max(1);
        let mut cloud = writer.start_map(of.div_ceil(every) as usize)?;
        let map_from_world = self.map_from_world[run];
        let mut first = 0;
        for (tile, surfels) in tiles {
            host.go_on()?;
            let mut chosen = drawn(run as u32, every, first..first + surfels).peekable();
            if chosen.peek().is_some() {
                for (number, disc) in (first..).zip(map.discs_in_own(tile)?) {
                    if chosen.next_if_eq(&number).is_none() {
                        continue;
                    }
                    let OwnDisc { centre_in_own_m, normal_in_own } = disc;
                    let residual_m = cubes.get(&self.cube_of(centre_in_own_m)).map(|sum| rms_m(*sum));
                    let point = self.point_in_map(self.at(run, centre_in_own_m), residual_m);
                    let normal = map_from_world.rotation * Vector3::from(normal_in_own.map(f64::from));
                    cloud.push_surfel(&point, normal.map(|c| c as f32).into());
                }
            }
            first += surfels;
        }
        Ok(Shown { shown: u64::from(writer.map(run, cloud)?), of })
    }

    /// How much the returns of a run are off, where it has them.
    fn cubes(&self, run: usize, host: &Hosted) -> anyhow::Result<Cubes> {
        let (index_of, runs) = (self.gathered.index_of(), self.names.len().max(1));
        let mut cubes = Cubes::new();
        self.gathered.each(host, |number, returns, _| {
            let Some(&frame) = index_of.get(&number) else { return Ok(()) };
            let sensor_m = self.gathered.frames[frame].position_in_world_m[run];
            for bytes in returns.iter().skip(run).step_by(runs) {
                let SampledReturn { from_sensor_m, residual_m: Some(residual_m), .. } =
                    SampledReturn::of_bytes(bytes)
                else {
                    continue;
                };
                let at_m = |axis: usize| sensor_m[axis] + f64::from(from_sensor_m[axis]);
                let (count, sum_m2) = cubes.entry(self.cube_of([0, 1, 2].map(at_m))).or_default();
                *count += 1;
                *sum_m2 += residual_m.abs().min(self.cut_m()).powi(2);
            }
            Ok(())
        })?;
        Ok(cubes)
    }

    fn cube_of(&self, at_m: [f64; 3]) -> [i32; 3] {
        let edge_m = CUBE_M * self.scales().lengths().metre_m;
        at_m.map(|m| (m / edge_m).floor() as i32)
    }
}

fn rms_m((count, sum_m2): (u32, f32)) -> f32 {
    (sum_m2 / count.max(1) as f32).sqrt()
}

/// Adds a return of a scan, in the frame of its sensor.
pub(super) fn push_return(
    cloud: &mut SceneCloud,
    sampled: &SampledReturn,
    sensor_from_axes: &UnitQuaternion<f64>,
    scales: Scales,
) {
    let place = sensor_from_axes * Point3::from(sampled.from_sensor_m.map(f64::from));
    let residual_m = sampled.residual_m;
    let place_m = place.coords.map(|m| m as f32).into();
    cloud.push(&ScenePoint { place_m, colour: colour_of_residual(residual_m, scales), residual_m });
}
