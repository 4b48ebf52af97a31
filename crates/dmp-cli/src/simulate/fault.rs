//! What is wrong where nothing can be simulated.

use dmp_sim::SimError;

use crate::exit::Usage;

/// A number out of range, or a route of other places, was given on the command line; whatever else is wrong is wrong with the run.
pub(super) fn told(error: SimError) -> anyhow::Error {
    match error {
        SimError::OutOfRange { .. } | SimError::OtherPlace { .. } => Usage(error.to_string()).into(),
        other => other.into(),
    }
}
