//! What a score in parts took here.

use serde::{Deserialize, Serialize};

/// What was measured on this machine, for the model.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Measured {
    pub(super) machine: String,
    pub(super) returns: f64,
    pub(super) runs: f64,
    pub(super) log_bytes: f64,
    pub(super) sums_bytes: f64,
    pub(super) map_bytes: f64,
    pub(super) plan_s: f64,
    pub(super) reduce_s: f64,
    /// Core seconds of each part, by stage.
    pub(super) parts_s: [Vec<f64>; 4],
}
