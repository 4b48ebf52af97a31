//! The drift stage: registers the visits of some pairs.

use std::path::PathBuf;

use dmp::{PlannedScore, Revisits, VisitPair};
use dmp_revisit::drift::{DriftReport, VisitPairReport};
use serde::{Deserialize, Serialize};

use super::error::ShardError;
use super::opened::Shard;
use super::part::Part;
use super::stage::Stage;

/// The result of a part.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct DriftPart {
    /// The number of its first pair among those of all runs, and what was measured on each.
    first: u64,
    /// As JSON, the serialised form of reports.
    visits: Vec<u8>,
}

/// Pairs of visits of a run.
type RunPairs<'r, 'e> = (&'r Revisits<'e>, &'r [VisitPair]);

/// The pairs of visits of all runs, one run after the other.
pub(super) struct AllRevisits<'e>(Vec<Revisits<'e>>);

impl<'e> AllRevisits<'e> {
    pub(super) fn new(planned: &'e PlannedScore<'_>) -> Self {
        Self((0..planned.runs().len()).map(|run| planned.revisits(run)).collect())
    }

    /// Number of pairs of each run.
    fn counts(&self) -> impl Iterator<Item = usize> {
        self.0.iter().map(|revisits| revisits.pairs().len())
    }

    /// The number of a part's first pair, and its pairs of each run.
    pub(super) fn of_part<'r>(&'r self, part: Part) -> (usize, Vec<RunPairs<'r, 'e>>) {
        let share = part.share(&vec![1; self.counts().sum()]);
        let mut before = 0;
        let of_run = |revisits: &'_ Revisits<'e>| {
            let (from, count) = (before, revisits.pairs().len());
            before += count;
            let within = |end: usize| end.saturating_sub(from).min(count);
            within(share.start)..within(share.end)
        };
        let ranges: Vec<_> = self.0.iter().map(of_run).collect();
        let pairs = self.0.iter().zip(ranges).map(|(revisits, range)| (revisits, &revisits.pairs()[range]));
        (share.start, pairs.collect())
    }
}

impl Shard<'_> {
    /// Measures the drift of the runs on some pairs of visits. Returns the receipt file that marks the part
    /// as done.
    ///
    /// # Errors
    /// When the log cannot be read or nothing can be written.
    pub fn drift(&self, part: Part) -> Result<PathBuf, ShardError> {
        let planned = self.planned()?;
        let revisits = AllRevisits::new(&planned);
        let (first, pairs) = revisits.of_part(part);
        let mut measured = Vec::new();
        for (revisits, pairs) in pairs {
            measured.extend(revisits.measure(pairs)?);
        }
        let visits = serde_json::to_vec(&measured).map_err(|error| ShardError::Content {
            path: self.folder.path.to_owned(),
            detail: error.to_string(),
        })?;
        self.folder.write(Stage::Drift, part, &DriftPart { first: first as u64, visits })
    }

    /// The drift of all runs, from all parts.
    pub(super) fn drifted(&self, planned: &PlannedScore<'_>) -> Result<DriftReport, ShardError> {
        let revisits = AllRevisits::new(planned);
        let mut all = self.measured(revisits.counts().sum())?.into_iter();
        let mut measured = Vec::new();
        for revisits in revisits.0 {
            measured.push((all.by_ref().take(revisits.pairs().len()).collect(), revisits));
        }
        Ok(planned.drift(measured))
    }

    /// The measurements of all pairs, in their order.
    fn measured(&self, pairs: usize) -> Result<Vec<VisitPairReport>, ShardError> {
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
