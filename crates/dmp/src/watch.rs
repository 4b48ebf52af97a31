use dmp_map::Store;
use dmp_reduce::{FrameSums, Residuals};
use dmp_sensor::{Isometry3, Ray};

use crate::places::ScoredPlace;
use crate::report::Report;

/// What is being done at the moment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Stage {
    /// A sample of scans is looked at: the vehicle, the density. Counted in scans.
    Survey,
    /// The map of a run is read from a file. Counted in points.
    ReadMap,
    /// Returns are fused into every run's map. Counted in returns.
    Fuse,
    /// Surfels are made and stored. Counted in tiles.
    Surfels,
    /// What returns' rays pass through is counted, to find trails. Counted in returns.
    Trails,
    /// Returns are cast into every run's map. Counted in returns.
    Cast,
    /// Places are scored, each by itself. Counted in places.
    Places,
    /// Loop candidates are tried, each by itself. Counted in candidates.
    Candidates,
}

/// Used returns of one frame, as they were cast. A frame comes in one or more such parts.
#[derive(Debug, Clone, Copy)]
pub struct ScoredReturns<'a> {
    /// The frame's number in the log.
    pub frame: usize,
    /// How many of the frame's used returns came in parts before this one.
    pub first: usize,
    /// When each return was measured, nanoseconds after the frame's stamp.
    pub offsets_ns: &'a [i64],
    /// For every run, the pose of the sensor at the frame's stamp, or in its line, in the frame of its trajectory.
    pub own_from_sensor: &'a [Isometry3<f64>],
    /// For every run, the frame of its trajectory, seen from the world that it is scored in.
    pub own_from_world: &'a [Isometry3<f64>],
    /// For every run, the rays of the same returns in the same order: `rays[run][index]`. See [`Self::own_ray`].
    pub rays: &'a [Vec<Ray>],
    /// For every run, what the rays left: `residuals[run][index]`.
    pub residuals: &'a [Vec<Residuals>],
}

impl ScoredReturns<'_> {
    /// The ray of a return in the frame of the run's trajectory.
    pub fn own_ray(&self, run: usize, index: usize) -> Ray {
        self.rays[run][index].moved(&self.own_from_world[run])
    }
}

/// Somebody who follows an evaluation; called from several threads at once.
///
/// `()` watches nothing.
pub trait Watch: Sync {
    /// A stage begins; `total` is what [`Watch::advance`] will add up to, 0 where that is not known.
    fn begin(&self, stage: Stage, total: u64) {
        let _ = (stage, total);
    }

    /// So much more of the stage is done.
    fn advance(&self, amount: u64) {
        let _ = amount;
    }

    /// Something worth knowing while the evaluation goes on; the report has it too.
    fn note(&self, text: &str) {
        let _ = text;
    }

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

    /// Whether every return must come by here: rays that an earlier process has cast are then cast again, where an
    /// evaluation is [resumed](crate::Config::resume).
    fn wants_every_return(&self) -> bool {
        false
    }

    /// Whether to stop: asked before every frame. The evaluation then ends with
    /// [`EvaluateError::Cancelled`](crate::EvaluateError::Cancelled) and leaves nothing behind.
    fn cancelled(&self) -> bool {
        false
    }
}

impl Watch for () {}
