//! What can be set of a study.

use crate::peers::PeerOptions;
use crate::truth::TruthOptions;

/// What can be set beside the scoring itself.
#[derive(Debug, Clone, PartialEq)]
pub struct StudyOptions {
    /// How runs are compared with the reference trajectory.
    pub truth: TruthOptions,
    /// A distance from the reference surface beyond this counts as this, metres.
    pub surface_cap_m: f64,
    /// The map metrics of others; `None` leaves them out.
    pub peers: Option<PeerOptions>,
    /// About so many returns of each run stand for its map, where peers and surface distance are taken.
    pub max_points: usize,
    /// MOM looks for its planes in as many of the first scans as have so many used returns.
    pub mom_returns: usize,
}

impl Default for StudyOptions {
    fn default() -> Self {
        Self {
            truth: TruthOptions::default(),
            surface_cap_m: 1.0,
            peers: Some(PeerOptions::default()),
            max_points: 300_000,
            mom_returns: 3_000,
        }
    }
}
