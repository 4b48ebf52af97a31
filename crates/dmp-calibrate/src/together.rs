//! Whether scans belong to poses at all.

use std::collections::HashMap;

use dmp_sensor::{Track, Vector3};
use rayon::prelude::*;

use crate::mount::Mount;
use crate::sample::Block;

/// Edge of the cells in which scans must meet, metres of a drive.
const CELL_M: f64 = 0.5;
/// Every how many-th return takes part.
const EVERY: usize = 4;

/// How well scans fit together.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Together {
    /// Returns with a pose.
    pub returns: u64,
    /// Those in whose cell another scan of the same block has one too.
    pub met: u64,
    /// The way from scan to scan within the blocks, metres.
    pub way_m: f64,
}

impl Together {
    /// Share of the returns that meet another scan.
    pub fn share(&self) -> f64 {
        self.met as f64 / self.returns.max(1) as f64
    }
}

/// Which poses the scans of a block are put at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Order {
    /// Each at its own.
    Own,
    /// Each at that of another scan of its block, first for last: what scans come to that have nothing to do with the poses.
    Reversed,
}

/// How well the scans of each block fit together, put at poses that are looked up so much later.
pub fn together(
    blocks: &[Block],
    mount: &Mount<'_>,
    later_ns: i64,
    order: Order,
    metre_m: f64,
) -> Vec<Together> {
    let track = Track::new(mount.trajectory, mount.body_from_sensor, mount.max_gap_ns);
    blocks.par_iter().map(|block| of_block(block, track, later_ns, order, CELL_M * metre_m)).collect()
}

fn of_block(block: &Block, track: Track<'_>, later_ns: i64, order: Order, cell_m: f64) -> Together {
    let mut found = Together::default();
    // Of every cell: its returns, the last scan in it, and whether there was another.
    let mut cells: HashMap<[i64; 3], (u64, usize, bool)> = HashMap::new();
    let mut before: Option<Vector3<f64>> = None;
    for (number, snapshot) in block.scans.iter().enumerate() {
        let posed_like = match order {
            Order::Own => snapshot,
            Order::Reversed => &block.scans[block.scans.len() - 1 - number],
        };
        let mut cursor = track.cursor();
        let mut first = true;
        for one in snapshot.returns.iter().step_by(EVERY) {
            let at = posed_like.stamp_ns.checked_add(one.after_ns).and_then(|ns| ns.checked_add(later_ns));
            let Some(pose) = at.and_then(|ns| cursor.world_from_sensor_at(ns)) else { continue };
            let place = pose.translation.vector + pose.rotation * one.in_sensor_m;
            if first {
                let here = pose.translation.vector;
                found.way_m += before.map_or(0.0, |before| (here - before).norm());
                (before, first) = (Some(here), false);
            }
            found.returns += 1;
            let cell = [place.x, place.y, place.z].map(|c| (c / cell_m).floor() as i64);
            let (returns, last, shared) = cells.entry(cell).or_insert((0, number, false));
            *returns += 1;
            *shared |= *last != number;
            *last = number;
        }
    }
    found.met = cells.values().filter(|cell| cell.2).map(|cell| cell.0).sum();
    found
}
