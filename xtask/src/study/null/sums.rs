//! The sums of an evaluation, and what is estimated of them at every scale.

use std::sync::{Mutex, PoisonError};

use dmp::{Basis, Confidence, FrameSums, Promise, Scales, Sink};
use dmp_reduce::{Estimate, Layout, Reducer, ScaleComparison};

/// Adds up an evaluation, so that it can be judged again at other levels.
pub(super) struct Sums(Mutex<Reducer>);

impl Sums {
    pub(super) fn new(frames: usize, runs: usize, scales: Scales) -> Self {
        let layout = Layout::new(frames as u64, vec![Basis::CrossValidated; runs]).on_scales(scales);
        Self(Mutex::new(Reducer::new(layout)))
    }

    pub(super) fn finish(self) -> Reducer {
        self.0.into_inner().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Sink for Sums {
    fn frame_scored(&self, frame: usize, sums: &FrameSums) {
        let mut reducer = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        // A frame that does not fit would show in the counts: none are left out.
        if let Err(error) = reducer.add_frame(frame as u64, sums) {
            eprintln!("scan {frame}: {error}");
        }
    }
}

/// A value with its standard error, square metres.
#[derive(Debug, Clone, Copy)]
pub(super) struct Estimated {
    pub(super) value_m2: f64,
    pub(super) error_m2: f64,
}

impl Estimated {
    fn of(estimate: Estimate) -> Option<Self> {
        let interval = estimate.interval?;
        let half_m2 = 0.5 * (interval.high_m2 - interval.low_m2);
        let error_m2 = half_m2 / Confidence::P99.student_t(interval.degrees);
        Some(Self { value_m2: estimate.value_m2, error_m2 })
    }
}

/// What is estimated at each scale, metres.
pub(super) type Values = Vec<(f64, Estimated)>;

/// Differences of all pairs, and the scores of all runs, at every scale that has an interval.
pub(super) struct AtScales {
    pub(super) differences: Vec<Values>,
    pub(super) scores: Vec<Values>,
}

impl AtScales {
    pub(super) fn of(reducer: &Reducer) -> Self {
        let of_pair = |(a, b): (usize, usize)| {
            let pair = reducer.compare(a, b, Promise::default());
            let of_scale = |scale: &ScaleComparison| Some((scale.scale_m, Estimated::of(scale.difference?)?));
            pair.scales.iter().filter_map(of_scale).collect()
        };
        let of_run = |run: usize| {
            let scores = reducer.scores(run, Confidence::P99).r_cv_m2;
            scores.iter().filter_map(|(scale_m, score)| Some((*scale_m, Estimated::of((*score)?)?))).collect()
        };
        let runs = reducer.layout().bases().len();
        Self {
            differences: all_pairs(reducer).into_iter().map(of_pair).collect(),
            scores: (0..runs).map(of_run).collect(),
        }
    }
}

fn all_pairs(reducer: &Reducer) -> Vec<(usize, usize)> {
    let runs = reducer.layout().bases().len();
    (0..runs).flat_map(|a| (a + 1..runs).map(move |b| (a, b))).collect()
}
