//! What can go wrong with an optimisation.

use dmp_sensor::{Disconnected, EdgeFault};

/// Why a graph cannot be optimised.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum OptimiseError {
    /// An added edge is none that the graph can have.
    #[error("the added edge {index} from {from} to {to}: {fault}")]
    Edge {
        /// Its place among the added edges, from 0.
        index: usize,
        /// The vertex that it leads from.
        from: i64,
        /// The vertex that it leads to.
        to: i64,
        /// What is wrong with it.
        fault: EdgeFault,
    },
    /// Parts of the graph could move against each other.
    #[error(transparent)]
    Disconnected(#[from] Disconnected),
    /// An option makes no sense.
    #[error("{what} of {value}: it must be a number above 0")]
    Option {
        /// The option.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// The measurements are so far off, or their information so large, that the sum of squares is no number.
    #[error("the sum of squares is {chi2}: measurements or their information are too large to be optimised")]
    NotFinite {
        /// The sum at the poses of the start.
        chi2: f64,
    },
    /// The measurements do not determine the poses numerically.
    #[error(
        "the measurements do not determine the poses: the information of some is too large, or too small beside that of others"
    )]
    Undetermined,
}
