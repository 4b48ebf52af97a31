//! The points of every run's map, thinned alike.

use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

use dmp::{ScoredReturns, ScoredRun, Sink};

use super::consistency::mix;

/// One return of so many is kept: some 300,000 of a drive of the suite.
const EVERY: u64 = 16;

/// Points in the worlds of the runs, for each run.
type Points = Vec<Vec<[f64; 3]>>;

/// Collects the returns of an evaluation. The same returns are kept for every run.
#[derive(Debug, Default)]
pub(super) struct Clouds(Mutex<BTreeMap<(usize, usize), Points>>);

impl Clouds {
    /// The k-th point of a cloud is the same return in every run.
    pub(super) fn finish(self) -> Points {
        let mut clouds = Points::new();
        for part in self.0.into_inner().unwrap_or_else(PoisonError::into_inner).into_values() {
            clouds.resize_with(clouds.len().max(part.len()), Vec::new);
            clouds.iter_mut().zip(part).for_each(|(cloud, mut points)| cloud.append(&mut points));
        }
        clouds
    }
}

impl Sink for Clouds {
    fn returns_scored(&self, scored: &ScoredReturns<'_>) {
        let Some(runs) = scored.runs.iter().map(Option::as_ref).collect::<Option<Vec<_>>>() else { return };
        // By a hash: every n-th return would be of the same beams in every scan.
        let is_kept = |k: usize| {
            mix(mix(scored.frame as u64) ^ (scored.first + k) as u64).is_multiple_of(EVERY)
                && runs.iter().all(|run| run.is_posed[k])
        };
        let of_run = |run: &&ScoredRun<'_>| {
            let kept = (0..run.rays.len()).filter(|&k| is_kept(k));
            kept.map(|k| run.own_ray(k).endpoint_in_world()).collect()
        };
        let points = runs.iter().map(of_run).collect();
        let mut parts = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        parts.insert((scored.frame, scored.first), points);
    }
}
