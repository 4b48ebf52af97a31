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
    /// Which scan of the log it is, the first being 0.
    pub(crate) number: usize,
    /// `None` where the log has no stamps.
    pub(crate) stamp_ns: Option<i64>,
    pub(crate) returns: Vec<Return>,
}

/// Where the sensor has a return, metres, and how long after the scan's stamp it was measured, nanoseconds.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Return {
    pub(crate) in_sensor_m: Vector3<f64>,
    pub(crate) after_ns: i64,
}

impl Block {
    /// Adds the scan of this number in the log, made at `stamp_ns` on its clock: up to `most` of the returns that `is_used`
    /// allows, evenly spread.
    pub fn add(
        &mut self,
        number: usize,
        stamp_ns: Option<i64>,
        scan: &Scan,
        most: usize,
        is_used: impl Fn([f32; 3]) -> bool,
    ) {
        let used: Vec<usize> = (0..scan.len()).filter(|&k| is_used(scan.points_in_sensor_m[k])).collect();
        let count = most.min(used.len());
        let one = |k: usize| {
            let at = used[k * used.len() / count];
            let in_sensor_m = Vector3::from(scan.points_in_sensor_m[at].map(f64::from));
            Return { in_sensor_m, after_ns: scan.time_offsets_ns.get(at).copied().unwrap_or(0) }
        };
        self.scans.push(Snapshot { number, stamp_ns, returns: (0..count).map(one).collect() });
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
