//! Receives the results of an evaluation while it runs: returns, frames, places, maps.

use dmp_map::Store;
use dmp_reduce::{FrameSums, Residuals};
use dmp_sensor::{Isometry3, Ray};

use dmp_report::Report;

/// Used returns of one frame, as cast. A frame comes in one or more such parts.
#[derive(Debug, Clone, Copy)]
pub struct ScoredReturns<'a> {
    /// The frame's number in the log.
    pub frame: usize,
    /// Its ordinal among the frames that are scored, or that a sample is drawn from.
    pub ordinal: usize,
    /// Number of the frame's used returns in earlier parts.
    pub first: usize,
    /// Time of each return, nanoseconds after the frame's stamp.
    pub offsets_ns: &'a [i64],
    /// The same returns in every run; `None` for a run without a pose for the frame.
    pub runs: &'a [Option<ScoredRun<'a>>],
}

/// Used returns of one frame in one run.
#[derive(Debug, Clone, Copy)]
pub struct ScoredRun<'a> {
    /// The pose of the sensor at the frame's stamp, or of its line, in the frame of the run's trajectory.
    pub own_from_sensor: Isometry3<f64>,
    /// The transform from the world in which the run is scored to the frame of its trajectory.
    pub own_from_world: Isometry3<f64>,
    /// The ray of every return, in that world. See [`Self::own_ray`].
    pub rays: &'a [Ray],
    /// The residuals of every ray.
    pub residuals: &'a [Residuals],
    /// For each return whether the run has a pose at its time; ray and residuals mean nothing where not.
    pub is_posed: &'a [bool],
}

impl ScoredRun<'_> {
    /// The ray of a return in the frame of the run's trajectory.
    pub fn own_ray(&self, index: usize) -> Ray {
        self.rays[index].moved(&self.own_from_world)
    }
}

/// Receives the results of an evaluation while it runs; called from several threads at once. `()` ignores
/// them.
pub trait Sink: Sync {
    /// Returns are scored. Parts of a frame come in order, frames in any order.
    fn returns_scored(&self, returns: &ScoredReturns<'_>) {
        let _ = returns;
    }

    /// A frame is scored: its number in the log and the sums of its runs and pairs. Frames come in any order.
    fn frame_scored(&self, frame: usize, sums: &FrameSums) {
        let _ = (frame, sums);
    }

    /// Everything is scored and the maps still exist, one per run: called once, by one thread.
    fn scored(&self, report: &Report, maps: &[&Store]) {
        let _ = (report, maps);
    }

    /// Approximate number of bytes that it will write to the work folder for this many returns, counted
    /// before anything is written.
    fn work_bytes(&self, returns: u64) -> u64 {
        let _ = returns;
        0
    }

    /// Whether it needs every return: a [resumed](crate::Config::resume) evaluation then casts all rays
    /// again.
    fn wants_every_return(&self) -> bool {
        false
    }
}

impl Sink for () {}
