//! Which places of a map change when its patches move.

use std::collections::HashMap;

use dmp_sensor::Isometry3;
use nalgebra::Point3;

use super::build::{LoopMap, placement};

/// Which patches have something in each column of the world.
#[derive(Debug)]
pub(super) struct Columns {
    columns: HashMap<[i64; 2], Vec<u32>>,
    /// Edge of a column, metres.
    column_m: f64,
}

impl Columns {
    pub(super) fn new(map: &LoopMap, world_from_body: &[Isometry3<f64>]) -> Self {
        let column_m = map.scales.lengths().loop_map.column_m;
        let mut columns: HashMap<[i64; 2], Vec<u32>> = HashMap::new();
        for (number, pose) in world_from_body.iter().enumerate() {
            let placement = placement(pose);
            for bounds_m in map.patches.bounds_m(number) {
                for column in columns_of(placement.bounds_m(bounds_m), column_m) {
                    let patches = columns.entry(column).or_default();
                    if patches.last() != Some(&(number as u32)) {
                        patches.push(number as u32);
                    }
                }
            }
        }
        Self { columns, column_m }
    }

    fn patches_in(&self, bounds_m: [[f64; 3]; 2]) -> impl Iterator<Item = usize> {
        columns_of(bounds_m, self.column_m)
            .filter_map(|column| self.columns.get(&column))
            .flatten()
            .map(|&number| number as usize)
    }
}

/// The columns that a box in the world reaches into.
fn columns_of([low, high]: [[f64; 3]; 2], column_m: f64) -> impl Iterator<Item = [i64; 2]> {
    let column = |c: f64| (c / column_m).floor() as i64;
    let (xs, ys) = (column(low[0])..=column(high[0]), column(low[1])..=column(high[1]));
    xs.flat_map(move |x| ys.clone().map(move |y| [x, y]))
}

/// How two patches moved against each other, seen from where one of them is.
#[derive(Debug, Clone, Copy)]
struct Motion {
    shift_m: f64,
    turn_rad: f64,
}

/// Patches at new poses beside what they were at before.
pub(super) struct Moved<'a> {
    map: &'a LoopMap,
    before: &'a [Isometry3<f64>],
    after: &'a [Isometry3<f64>],
    columns_before: &'a Columns,
    columns_after: Columns,
}

impl<'a> Moved<'a> {
    pub(super) fn new(
        map: &'a LoopMap,
        before: &'a [Isometry3<f64>],
        columns_before: &'a Columns,
        after: &'a [Isometry3<f64>],
    ) -> Self {
        Self { map, before, after, columns_before, columns_after: Columns::new(map, after) }
    }

    pub(super) fn map(&self) -> &'a LoopMap {
        self.map
    }

    /// For every group of rays of a keyframe, whether the map where they end may have changed: a patch that has
    /// something there, before or after, moved against the keyframe by more than [`MapOptions::moved_m`](super::MapOptions).
    pub(super) fn changed(&self, keyframe: usize) -> Vec<bool> {
        if self.map.moved_m() == 0.0 {
            return vec![true; self.map.rays[keyframe].groups().len()];
        }
        let mut motions: HashMap<usize, Motion> = HashMap::new();
        let mut has_moved = |patch: usize, range_m: f64| {
            let motion = motions.entry(patch).or_insert_with(|| self.motion(keyframe, patch));
            motion.shift_m + motion.turn_rad * range_m > self.map.moved_m()
        };
        let near_m = self.map.scales.lengths().loop_map.near_m;
        let [before, after] = [self.before, self.after].map(|poses| placement(&poses[keyframe]));
        let changed = |group: &super::rays::Group| {
            let [low, high] = group.bounds_m;
            let farthest = (0..3).map(|k| low[k].abs().max(high[k].abs()));
            let range_m = farthest.map(|c| c * c).sum::<f64>().sqrt();
            // What is nearest to a return may lie in front of it or behind.
            let near_m = [low.map(|c| c - near_m), high.map(|c| c + near_m)];
            let around = self.columns_before.patches_in(before.bounds_m(near_m));
            let around = around.chain(self.columns_after.patches_in(after.bounds_m(near_m)));
            around.into_iter().any(|patch| has_moved(patch, range_m))
        };
        self.map.rays[keyframe].groups().iter().map(changed).collect()
    }

    /// How a patch moved where a keyframe is, as the keyframe sees it.
    fn motion(&self, keyframe: usize, patch: usize) -> Motion {
        if keyframe == patch {
            return Motion { shift_m: 0.0, turn_rad: 0.0 };
        }
        // What of the patch was at the keyframe, and where it is now.
        let [in_patch, now] = [self.before, self.after].map(|poses| poses[patch].inv_mul(&poses[keyframe]));
        let shift_m = (in_patch.inv_mul(&now) * Point3::origin()).coords.norm();
        Motion { shift_m, turn_rad: in_patch.rotation.angle_to(&now.rotation) }
    }
}
