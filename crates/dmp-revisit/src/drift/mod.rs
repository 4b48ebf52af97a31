//! How far a run is off where it comes back: the pose that registration gives a second visit, beside that of the run.

mod constraint;
mod displacement;
mod register;
mod report;
mod summary;

pub use constraint::{covariance_in, upper_triangle};
pub use displacement::{Axes, Displacement};
pub use register::{Seen, at_least_m, register, searched_m};
pub use report::{DriftBin, DriftComparison, DriftReport, Measured, RunDrift, VisitPairReport, VisitReport};
pub use summary::{PairFacts, RunFacts, blocks, compared, of_run};
