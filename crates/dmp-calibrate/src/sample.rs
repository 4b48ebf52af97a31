//! The scans that are looked at.

use dmp_sensor::{Scan, Vector3};

/// Scans of one part of the log, near enough to each other to see the same surfaces.
#[derive(Debug, Clone, Default)]
pub struct Block {
    pub(crate) scans: Vec<Snapshot>,
}

/// A scan with few of its returns.
#[derive(Debug, Clone)]
pub(crate) struct Snapshot {
    pub(crate) stamp_ns: i64,
    pub(crate) returns: Vec<Return>,
}

/// Where the sensor has a return, metres, and how long after the scan's stamp it was measured, nanoseconds.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Return {
    pub(crate) in_sensor_m: Vector3<f64>,
    pub(crate) after_ns: i64,
}

impl Block {
    /// From its first scan to its last, seconds.
    pub fn duration_s(&self) -> f64 {
        let ends = self.scans.first().zip(self.scans.last());
        ends.map_or(0.0, |(first, last)| last.stamp_ns.saturating_sub(first.stamp_ns) as f64 / 1e9)
    }

    /// Adds a scan that was made at `stamp_ns` on the log's clock: up to `most` of the returns that `is_used` allows, evenly
    /// spread.
    pub fn add(&mut self, stamp_ns: i64, scan: &Scan, most: usize, is_used: impl Fn([f32; 3]) -> bool) {
        let used: Vec<usize> = (0..scan.len()).filter(|&k| is_used(scan.points_in_sensor_m[k])).collect();
        let count = most.min(used.len());
        let one = |k: usize| {
            let at = used[k * used.len() / count];
            let in_sensor_m = Vector3::from(scan.points_in_sensor_m[at].map(f64::from));
            Return { in_sensor_m, after_ns: scan.time_offsets_ns.get(at).copied().unwrap_or(0) }
        };
        self.scans.push(Snapshot { stamp_ns, returns: (0..count).map(one).collect() });
    }
}

/// The scans of a block that begins with `start`, of a log with `scans`, the next block `room` later: at growing distances,
/// so that slow and fast vehicles both have scans a little and scans far enough apart.
pub fn scans_of_block(start: usize, room: usize, scans: usize, most: usize) -> Vec<usize> {
    let steps = (0..).map(|k: u32| (1_usize << k.min(40)) - 1);
    steps
        .take(most)
        .take_while(|&step| step < room.max(2))
        .map(|step| start + step)
        .take_while(|&k| k < scans)
        .collect()
}
