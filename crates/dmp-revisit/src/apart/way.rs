//! Scans of two runs along their way, and with what they are laid against each other.

use dmp_reduce::{Lengths, Scales};
use dmp_sensor::Isometry3;

use super::moments::Moments;

/// A scan for which both runs have a pose.
#[derive(Debug, Clone, Copy)]
pub(super) struct ScanInBoth {
    /// Its number in the log.
    pub(super) scan: u64,
    /// The pose of the sensor in each run, in any frame of the run.
    pub(super) run_from_sensor: [Isometry3<f64>; 2],
}

/// The same, with the travel up to it, metres: the mean of both runs.
pub(super) struct OnWay<'a> {
    pub(super) scan: &'a ScanInBoth,
    pub(super) along_m: f64,
}

/// What is compared, beside the poses.
#[derive(Debug, Clone, Copy)]
pub struct Ruler {
    /// How long what is a metre on a drive is here, metres.
    pub metre_m: f64,
    /// Scans with at least so much travel between them belong to different visits, metres.
    pub visits_m: f64,
    /// Whether scans see the same only in the same direction: those of a camera.
    pub is_camera: bool,
    /// Where the returns of a scan lie.
    pub returns: Moments,
}

/// The number of the place that a scan is in.
pub(super) fn place_of(scan: &OnWay<'_>, ruler: &Ruler) -> i64 {
    (scan.along_m / (PLACE_M * ruler.metre_m)).floor() as i64
}

/// Travel that is a place, and that two scans of a visit are apart at most, metres.
pub(super) const PLACE_M: f64 = 20.0;

impl Ruler {
    /// For recordings of this kind.
    pub fn of(scales: Scales, is_camera: bool, returns: Moments) -> Self {
        let Lengths { metre_m, pass_m: visits_m, .. } = *scales.lengths();
        Self { metre_m, visits_m, is_camera, returns }
    }

    /// How far apart two scans' points are put, metres: the root mean square over the returns of the second.
    pub(super) fn distance_m(&self, first: &OnWay<'_>, second: &OnWay<'_>) -> f64 {
        let [first, second] = [first, second].map(|on_way| on_way.scan.run_from_sensor);
        let [a, b] = [0, 1].map(|run| first[run].inv_mul(&second[run]));
        self.returns.moved_by_m(&a.inv_mul(&b))
    }
}
