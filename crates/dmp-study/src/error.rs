//! What can go wrong with a study.

use dmp::EvaluateError;
use dmp_truth::surface::SurfaceError;
use dmp_truth::trajectory::CompareError;

/// Why runs cannot be studied.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StudyError {
    /// A setting outside its range.
    #[error("{setting} {value}: {why}")]
    Setting {
        /// Which.
        setting: &'static str,
        /// What it was set to.
        value: f64,
        /// What it must be.
        why: &'static str,
    },
    /// A run has nothing in common with the reference trajectory, or too little to be aligned.
    #[error("run `{run}` cannot be compared with the reference trajectory")]
    Reference {
        /// The run.
        run: String,
        /// Why.
        source: CompareError,
    },
    /// The runs cannot be scored.
    #[error(transparent)]
    Evaluate(#[from] EvaluateError),
    /// A run's points cannot be compared with the reference surface.
    #[error("run `{run}` cannot be compared with the reference surface")]
    Surface {
        /// The run.
        run: String,
        /// Why.
        source: Box<SurfaceError>,
    },
    /// The reference surface cannot be read.
    #[error("the reference surface cannot be read")]
    ReadSurface(#[source] Box<dyn std::error::Error + Send + Sync>),
}
