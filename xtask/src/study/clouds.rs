//! The points of every run's map, thinned alike.

use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

use dmp::{ScoredReturns, ScoredRun, Sink};

use super::consistency::mix;

/// One return of so many is kept: some 300,000 of a drive of the suite.
const EVERY: u64 = 16;
/// Of so many first frames all returns are kept besides.
const FIRST_FRAMES: usize = 2;

/// Points in the worlds of the runs, for each run.
type Points = Vec<Vec<[f64; 3]>>;

/// Collects the returns of an evaluation. The same returns are kept for every run.
#[derive(Debug, Default)]
pub(super) struct Clouds(Mutex<BTreeMap<(usize, usize), [Points; 2]>>);

/// The k-th point of a cloud is the same return in every run.
#[derive(Debug, Default)]
pub(super) struct RunClouds {
    pub(super) thinned: Points,
    /// All returns of the first frames.
    pub(super) first: Points,
}

impl Clouds {
    pub(super) fn finish(self) -> RunClouds {
        let mut clouds = RunClouds::default();
        for [thinned, first] in self.0.into_inner().unwrap_or_else(PoisonError::into_inner).into_values() {
            append(&mut clouds.thinned, thinned);
            append(&mut clouds.first, first);
        }
        clouds
    }
}

fn append(to: &mut Points, part: Points) {
    to.resize_with(to.len().max(part.len()), Vec::new);
    to.iter_mut().zip(part).for_each(|(to, mut points)| to.append(&mut points));
}

impl Sink for Clouds {
    fn returns_scored(&self, scored: &ScoredReturns<'_>) {
        let points = |kept: &dyn Fn(usize) -> bool| -> Points {
            let of_run = |run: &ScoredRun<'_>| {
                let kept = (0..run.rays.len()).filter(|&k| kept(k));
                kept.map(|k| run.own_ray(k).endpoint_in_world()).collect()
            };
            scored.runs.iter().flatten().map(of_run).collect()
        };
        // By a hash: every n-th return would be of the same beams in every scan.
        let in_frame = |k: usize| mix(mix(scored.frame as u64) ^ (scored.first + k) as u64);
        let thinned = points(&|k| in_frame(k).is_multiple_of(EVERY));
        let first = points(&|_| scored.frame < FIRST_FRAMES);
        let mut parts = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        parts.insert((scored.frame, scored.first), [thinned, first]);
    }
}
