//! The drift stage: registers the visits of some pairs.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::error::ShardError;
use super::opened::Shard;
use super::part::Part;
use super::stage::Stage;
use crate::drift::{Revisits, VisitPair, VisitPairReport};

/// The result of a part.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct DriftPart {
    /// The number of its first pair, and what was measured on each.
    first: u64,
    /// As JSON, the serialised form of reports.
    visits: Vec<u8>,
}

/// The pairs of a part.
pub(super) fn pairs_of<'r, M: Sync>(revisits: &'r Revisits<'_, M>, part: Part) -> (usize, &'r [VisitPair]) {
    let pairs = revisits.pairs();
    let share = part.share(&vec![1; pairs.len()]);
    (share.start, &pairs[share])
}

impl Shard<'_> {
    /// Measures the drift of all runs on some pairs of visits. Returns the receipt file that marks the part
    /// as done.
    ///
    /// # Errors
    /// When the log cannot be read or nothing can be written.
    pub fn drift(&self, part: Part) -> Result<PathBuf, ShardError> {
        let planned = self.planned()?;
        let revisits = Revisits::new(&planned, planned.drift_pairs());
        let (first, pairs) = pairs_of(&revisits, part);
        let measured = revisits.measure(pairs)?;
        let visits = serde_json::to_vec(&measured).map_err(|error| ShardError::Content {
            path: self.folder.path.to_owned(),
            detail: error.to_string(),
        })?;
        self.folder.write(Stage::Drift, part, &DriftPart { first: first as u64, visits })
    }

    /// The measurements of all pairs, in their order.
    pub(super) fn drifted(&self, pairs: usize) -> Result<Vec<VisitPairReport>, ShardError> {
        let parts: Vec<(Part, DriftPart)> = self.folder.read(Stage::Drift)?;
        let mut all: Vec<VisitPairReport> = Vec::with_capacity(pairs);
        for (part, DriftPart { first, visits }) in parts {
            let content = |detail: String| ShardError::Content {
                path: self.folder.file(&super::folder::receipt_name(Stage::Drift, part)),
                detail,
            };
            if first != all.len() as u64 {
                return Err(content(format!("it begins with pair {first}, expected {}", all.len())));
            }
            let measured: Vec<VisitPairReport> =
                serde_json::from_slice(&visits).map_err(|error| content(error.to_string()))?;
            all.extend(measured);
        }
        if all.len() != pairs {
            let missing = format!("{} of {pairs} pairs of visits were measured", all.len());
            return Err(ShardError::Missing {
                folder: self.folder.path.to_owned(),
                stage: Stage::Drift,
                missing,
            });
        }
        Ok(all)
    }
}
