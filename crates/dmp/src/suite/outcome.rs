//! What is decided between two versions.

use serde::{Deserialize, Serialize};

/// What is decided between two versions over all logs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// One is better.
    Better,
    /// Neither is beyond chance.
    Undecided,
    /// However these logs had gone, they could not have decided.
    TooFewLogs,
}
