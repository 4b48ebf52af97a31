//! Whether scans belong to poses at all.

use dmp_reduce::Confidence;
use dmp_sensor::{Track, Vector3};
use rayon::prelude::*;

use crate::calibrate::evidence::Interval;
use crate::calibrate::knots::Knots;
use crate::calibrate::mount::Mount;
use crate::calibrate::sample::Block;

/// Edge of the cells in which scans must meet, metres of a drive.
const CELL_M: f64 = 0.5;
/// A run turns in a block if by more than this, radians: 10°.
const TURN: f64 = 0.174_53;
/// Every how many-th return takes part.
const EVERY: usize = 4;
/// A scan of fewer of these says nothing: of a range that is cut short, a few strays are left.
const ENOUGH: u64 = 20;

/// How well scans fit together.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Together {
    /// Returns with a pose.
    pub returns: u64,
    /// Those in whose cell another scan of the same block has one too.
    pub met: u64,
    /// Scans with a pose.
    pub scans: u64,
    /// Those with enough returns to say anything.
    pub full_scans: u64,
    /// The path from scan to scan within the blocks, metres, and its time, seconds.
    pub way_m: f64,
    /// See [`Self::way_m`].
    pub way_s: f64,
}

impl Together {
    fn and(self, other: Self) -> Self {
        Self {
            returns: self.returns + other.returns,
            met: self.met + other.met,
            scans: self.scans + other.scans,
            full_scans: self.full_scans + other.full_scans,
            way_m: self.way_m + other.way_m,
            way_s: self.way_s + other.way_s,
        }
    }

    /// Whether most scans have hardly any return: then it is chance which of them meet.
    pub fn is_too_thin(&self) -> bool {
        2 * self.full_scans < self.scans
    }

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
    /// Each at that of another scan of its block, first for last: what scans give that have nothing to do with the poses.
    Reversed,
    /// Each at its own place, all of a block turned as its first scan is.
    Straight,
}

/// How well the scans of each block fit together.
pub fn together_of_blocks(blocks: &[Block], mount: &Mount<'_>, order: Order, metre_m: f64) -> Vec<Together> {
    blocks.par_iter().map(|block| of_block(block, mount, order, CELL_M * metre_m)).collect()
}

/// How well the scans of every `one_in`-th block fit together; 1: of all.
pub fn together(blocks: &[Block], mount: &Mount<'_>, order: Order, metre_m: f64, one_in: usize) -> Together {
    let of_block = |block: &Block| of_block(block, mount, order, CELL_M * metre_m);
    total(&blocks.par_iter().step_by(one_in).map(of_block).collect::<Vec<_>>())
}

/// How well the scans of each block in which the run turns fit together: as it turns, and as if it did not.
pub fn together_in_turns(blocks: &[Block], mount: &Mount<'_>, metre_m: f64) -> [Vec<Together>; 2] {
    let turns = |block: &&Block| turn(block, mount).is_some_and(|turn| turn > TURN);
    let turning: Vec<&Block> = blocks.iter().filter(turns).collect();
    let fit = |order: Order| {
        let of_block = |block: &&Block| of_block(block, mount, order, CELL_M * metre_m);
        turning.par_iter().map(of_block).collect()
    };
    [fit(Order::Own), fit(Order::Straight)]
}

/// How many times as often the returns of some blocks meet in `one` way as in the `other`, with its interval.
pub fn times_as_often(one: &[Together], other: &[Together], confidence: Confidence) -> Option<Interval> {
    let both: Vec<(Together, Together)> = one.iter().copied().zip(other.iter().copied()).collect();
    Interval::of(&both, confidence, |blocks| {
        let (one, other): (Vec<Together>, Vec<Together>) = blocks.copied().unzip();
        total(&one).share() / total(&other).share()
    })
}

/// The sums over some blocks.
fn total(blocks: &[Together]) -> Together {
    blocks.iter().copied().fold(Together::default(), Together::and)
}

/// How far the run turns from the first scan of a block to the last, radians.
fn turn(block: &Block, mount: &Mount<'_>) -> Option<f64> {
    let mut cursor = Track::new(mount.trajectory, mount.body_from_sensor, mount.max_gap_ns).cursor();
    let ends = [block.scans.first()?, block.scans.last()?];
    let [first, last] = ends.map(|scan| cursor.world_from_sensor_at(mount.stamp_ns(scan)?));
    Some(first?.rotation.angle_to(&last?.rotation))
}

fn of_block(block: &Block, mount: &Mount<'_>, order: Order, cell_m: f64) -> Together {
    let track = Track::new(mount.trajectory, mount.body_from_sensor, mount.max_gap_ns);
    let mut found = Together::default();
    // Of every return its cell, and the scan.
    let mut cells: Vec<([i64; 3], usize)> = Vec::new();
    let mut before: Option<(i64, Vector3<f64>)> = None;
    let mut first_rotation = None;
    for (number, snapshot) in block.scans.iter().enumerate() {
        let posed_like = match order {
            Order::Own | Order::Straight => snapshot,
            Order::Reversed => &block.scans[block.scans.len() - 1 - number],
        };
        let Some(stamp_ns) = mount.stamp_ns(posed_like) else { continue };
        let mut cursor = track.cursor();
        let mut first = true;
        let returns_before = found.returns;
        let returns = || snapshot.returns.iter().step_by(EVERY);
        let known = Knots::of(returns().map(|one| one.after_ns), |after_ns| {
            cursor.world_from_sensor_at(stamp_ns.checked_add(after_ns)?)
        });
        for one in returns() {
            let Some(between) = known.between(one.after_ns) else { continue };
            let straight =
                (order == Order::Straight).then(|| *first_rotation.get_or_insert(between.ends[0].rotation));
            let place = between
                .place(|pose| pose.translation.vector + straight.unwrap_or(pose.rotation) * one.in_sensor_m);
            if first {
                let here = between.place(|pose| pose.translation.vector);
                if let Some((before_ns, before)) = before {
                    found.way_m += (here - before).norm();
                    found.way_s += stamp_ns.saturating_sub(before_ns) as f64 / 1e9;
                }
                (before, first) = (Some((stamp_ns, here)), false);
            }
            found.returns += 1;
            let cell = [place.x, place.y, place.z].map(|c| (c / cell_m).floor() as i64);
            cells.push((cell, number));
        }
        if cursor.world_from_sensor_at(stamp_ns).is_some() {
            found.scans += 1;
            found.full_scans += u64::from(found.returns - returns_before >= ENOUGH);
        }
    }
    cells.sort_unstable();
    let shared = cells.chunk_by(|a, b| a.0 == b.0).filter(|cell| cell.first() != cell.last());
    found.met = shared.map(|cell| cell.len() as u64).sum();
    found
}
