//! The progress of an evaluation, for a watcher that shows it and may stop it.

use std::sync::atomic::{AtomicU64, Ordering};

use crate::asked::note::Note;

/// The current stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Stage {
    /// Scans are read for vetting, counted in scans; then runs are vetted, counted in runs.
    Vet,
    /// A sample of scans is surveyed: the vehicle, the density. Counted in scans.
    Survey,
    /// The map of a run is read from a file. Counted in points.
    ReadMap,
    /// Returns are fused into every run's map. Counted in returns.
    Fuse,
    /// Surfels are computed and stored. Counted in tiles.
    Surfels,
    /// The rays of a sample of scans are followed through every map, to find what moved. Counted in returns.
    Trails,
    /// Returns are cast into every run's map. Counted in returns.
    Cast,
    /// Pairs of visits are registered. Counted in pairs of visits.
    Drift,
    /// Loop candidates are tried one by one. Counted in candidates.
    Candidates,
}

/// Follows an evaluation and may stop it; called from several threads at once. `()` does neither.
///
/// ```
/// use std::sync::atomic::{AtomicU64, Ordering};
///
/// /// Stops after a million returns.
/// #[derive(Default)]
/// struct Enough(AtomicU64);
///
/// impl dmp_runs::Progress for Enough {
///     fn advance(&self, amount: u64) {
///         self.0.fetch_add(amount, Ordering::Relaxed);
///     }
///     fn cancelled(&self) -> bool {
///         self.0.load(Ordering::Relaxed) > 1_000_000
///     }
/// }
/// ```
pub trait Progress: Sync {
    /// A stage begins; `total` is the final sum of [`Progress::advance`], 0 if unknown.
    fn begin(&self, stage: Stage, total: u64) {
        let _ = (stage, total);
    }

    /// This much more of the stage is done.
    fn advance(&self, amount: u64) {
        let _ = amount;
    }

    /// A note while the evaluation runs.
    fn note(&self, note: &Note) {
        let _ = note;
    }

    /// Whether to stop: queried before every frame. The evaluation then ends with
    /// [`EvaluateError::Cancelled`](crate::EvaluateError::Cancelled). It leaves nothing behind except the
    /// checkpoint of [`Config::checkpoint_every`](crate::Config::checkpoint_every).
    fn cancelled(&self) -> bool {
        false
    }
}

impl Progress for () {}

/// Reports a stage to `progress`, given how much of it is done so far and its total.
pub fn so_far(progress: &dyn Progress, stage: Stage) -> impl Fn(u64, u64) + Sync {
    let done = AtomicU64::new(0);
    move |so_far, total| {
        let before = done.swap(so_far, Ordering::Relaxed);
        if before == 0 {
            progress.begin(stage, total);
        }
        progress.advance(so_far - before);
    }
}
