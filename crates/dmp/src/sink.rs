//! What an evaluation finds, handed over while it runs: returns, frames, places, maps.

use dmp_map::Store;
use dmp_reduce::{FrameSums, Residuals};
use dmp_sensor::{Isometry3, Ray};

use crate::report::Report;

/// Used returns of one frame, as they were cast. A frame comes in one or more such parts.
#[derive(Debug, Clone, Copy)]
pub struct ScoredReturns<'a> {
    /// The frame's number in the log.
    pub frame: usize,
    /// Its place among the frames that are scored, or could be where a sample is.
    pub ordinal: usize,
    /// How many of the frame's used returns came in parts before this one.
    pub first: usize,
    /// When each return was measured, nanoseconds after the frame's stamp.
    pub offsets_ns: &'a [i64],
    /// The same returns in every run.
    pub runs: &'a [ScoredRun<'a>],
}

/// Used returns of one frame in one run.
#[derive(Debug, Clone, Copy)]
pub struct ScoredRun<'a> {
    /// The pose of the sensor at the frame's stamp, or in its line, in the frame of the run's trajectory.
    pub own_from_sensor: Isometry3<f64>,
    /// The frame of the run's trajectory, seen from the world that the run is scored in.
    pub own_from_world: Isometry3<f64>,
    /// The ray of every return, in that world. See [`Self::own_ray`].
    pub rays: &'a [Ray],
    /// What every ray left.
    pub residuals: &'a [Residuals],
}

impl ScoredRun<'_> {
    /// The ray of a return in the frame of the run's trajectory.
    pub fn own_ray(&self, index: usize) -> Ray {
        self.rays[index].moved(&self.own_from_world)
    }
}

/// A place of a quick score.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ScoredPlace {
    /// Its number along the way, from 0.
    pub number: usize,
    /// How many places there are.
    pub of: usize,
    /// Whether most runs have the way come back to it.
    pub is_revisited: bool,
}

/// Takes what an evaluation finds while it runs; called from several threads at once. `()` takes nothing.
pub trait Sink: Sync {
    /// Returns are scored. Parts of a frame come in order, frames in any order.
    fn returns_scored(&self, returns: &ScoredReturns<'_>) {
        let _ = returns;
    }

    /// A frame is scored: its number in the log and the sums of its runs and pairs. Frames come in any order.
    fn frame_scored(&self, frame: usize, sums: &FrameSums) {
        let _ = (frame, sums);
    }

    /// A place of a quick score is done, with the sums of its runs and pairs. They come in any order.
    fn place_scored(&self, place: ScoredPlace, sums: &FrameSums) {
        let _ = (place, sums);
    }

    /// Everything is scored and the maps are still there, one for each run: called once, by one thread. Not called where
    /// places are scored, each of which has maps of its own.
    fn scored(&self, report: &Report, maps: &[&Store]) {
        let _ = (report, maps);
    }

    /// Bytes that it will keep in the work folder of so many returns of the log, about: counted before anything is written.
    fn work_bytes(&self, returns: u64) -> u64 {
        let _ = returns;
        0
    }

    /// Whether every return must come by here: rays that an earlier process has cast are then cast again, where an
    /// evaluation is [resumed](crate::Config::resume).
    fn wants_every_return(&self) -> bool {
        false
    }
}

impl Sink for () {}
