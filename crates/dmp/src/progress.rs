//! What is being done at the moment, for whoever shows it, and may stop it.

use crate::note::Note;

/// What is being done at the moment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Stage {
    /// Scans are read by which runs are vetted, counted in scans; then runs are, counted in runs.
    Vet,
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
    /// Visits to the same places are brought onto each other. Counted in pairs of visits.
    Drift,
    /// Places are scored, each by itself. Counted in places.
    Places,
    /// Returns that were kept of several results are compared. Counted in returns.
    Compare,
    /// Loop candidates are tried, each by itself. Counted in candidates.
    Candidates,
}

/// Follows how far an evaluation is, and may stop it; called from several threads at once. `()` does neither.
///
/// ```
/// use std::sync::atomic::{AtomicU64, Ordering};
///
/// /// Stops after a million returns.
/// #[derive(Default)]
/// struct Enough(AtomicU64);
///
/// impl dmp::Progress for Enough {
///     fn advance(&self, amount: u64) {
///         self.0.fetch_add(amount, Ordering::Relaxed);
///     }
///     fn cancelled(&self) -> bool {
///         self.0.load(Ordering::Relaxed) > 1_000_000
///     }
/// }
/// ```
pub trait Progress: Sync {
    /// A stage begins; `total` is what [`Progress::advance`] will add up to, 0 where that is not known.
    fn begin(&self, stage: Stage, total: u64) {
        let _ = (stage, total);
    }

    /// So much more of the stage is done.
    fn advance(&self, amount: u64) {
        let _ = amount;
    }

    /// Something worth knowing while the evaluation goes on.
    fn note(&self, note: &Note) {
        let _ = note;
    }

    /// Whether to stop: asked before every frame. The evaluation then ends with
    /// [`EvaluateError::Cancelled`](crate::EvaluateError::Cancelled) and leaves nothing behind but what [`Config::checkpoint_every`](crate::Config::checkpoint_every) kept.
    fn cancelled(&self) -> bool {
        false
    }
}

impl Progress for () {}
