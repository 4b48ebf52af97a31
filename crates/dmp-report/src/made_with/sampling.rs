//! How much of the log was scored, in a report.

use serde::{Deserialize, Serialize};

/// How much of the log was scored.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SamplingReport {
    /// Scans scored.
    pub frames_scored: u64,
    /// Scans that could have been.
    pub frames_total: u64,
    /// Seed of the draws; null where all scans were scored and all returns cast.
    pub seed: Option<u64>,
    /// Of so many consecutive returns of a scored scan one was cast; 1: every one.
    #[serde(default = "every_one")]
    pub returns_one_in: usize,
    /// Where not scans but places were drawn: which; null where not.
    pub places: Option<PlacesReport>,
}

/// The places that a quick score was made at.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlacesReport {
    /// Places scored.
    pub drawn: u64,
    /// Places along the way.
    pub total: u64,
    /// How many of those scored the way comes back to, in most runs.
    pub revisited: u64,
    /// How many of all it comes back to.
    pub revisited_total: u64,
    /// Places for which not all scans were read, as there were too many.
    pub cut: u64,
    /// Length of a place along the way, metres.
    pub length_m: f64,
    /// Scans so near to a place's middle make its map, metres.
    pub radius_m: f64,
    /// The way from one of them to the next, metres.
    pub spacing_m: f64,
    /// Scans read for places, each counted once for each place.
    pub scans_read: u64,
    /// Whether these are as few as are ever drawn, whatever share of the log they take.
    pub are_fewest: bool,
    /// Share of the log's bytes that was to be read; null where the places were to grow until they decide.
    pub share_asked: Option<f64>,
    /// After how many looks at growing places all pairs were decided, or no more could be read; null where a share was asked.
    pub looks: Option<usize>,
    /// Bytes of the log that were read, index and all; null where it is not known.
    pub bytes_read: Option<u64>,
}

/// Of reports without the field.
fn every_one() -> usize {
    1
}
