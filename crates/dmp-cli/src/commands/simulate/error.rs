//! Errors of simulations, as the command reports them.

use dmp_sim::SimError;

use crate::console::Usage;

/// A number out of range, or a route of other scenery, is wrong usage; any other error is a failure.
pub(super) fn in_words(error: SimError) -> anyhow::Error {
    match error {
        SimError::OutOfRange { .. } | SimError::OtherPlace { .. } => Usage(error.to_string()).into(),
        other => other.into(),
    }
}
