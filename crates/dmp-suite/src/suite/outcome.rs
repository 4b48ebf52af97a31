//! The outcome between two versions.

use serde::{Deserialize, Serialize};

/// The outcome between two versions over all logs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// One is better.
    Better,
    /// The difference is not significant.
    Undecided,
    /// With this number of logs no outcome could be significant.
    TooFewLogs,
}
