//! The drive of a quick score: the scans that every run has a pose for, and their path.

use dmp_runs::{PlannedFrame, RunPath};

/// The scans that every run has a pose for.
#[derive(Debug, Clone)]
pub(crate) struct Drive {
    /// In order of time.
    pub(crate) frames: Vec<PlannedFrame>,
    /// For each of them its ordinal among the scans in use.
    pub(crate) in_use: Vec<usize>,
    /// The path length up to each of them, metres: the median over the runs per step, added up.
    pub(crate) along_m: Vec<f64>,
    /// Path length of the longest segment of any run, metres.
    pub(crate) longest_m: f64,
}

impl Drive {
    /// Of the scans in use, given the runs' paths.
    pub(crate) fn new(frames: &[PlannedFrame], paths: &[&RunPath]) -> Self {
        let in_all = |ordinal: &usize| paths.iter().all(|path| path.has(*ordinal));
        let in_use: Vec<usize> = (0..frames.len()).filter(in_all).collect();
        let step_m = |pair: &[usize]| {
            let of_run = |path: &&RunPath| path.along_m[pair[1]] - path.along_m[pair[0]];
            median(paths.iter().map(of_run).collect())
        };
        let mut along_m = vec![0.0; in_use.len().min(1)];
        for pair in in_use.windows(2) {
            along_m.push(along_m.last().copied().unwrap_or(0.0) + step_m(pair));
        }
        let longest_m = paths.iter().map(|path| longest_m(path)).fold(0.0, f64::max);
        let frames = in_use.iter().map(|&ordinal| frames[ordinal]).collect();
        Self { frames, in_use, along_m, longest_m }
    }

    /// Its length, metres.
    pub(crate) fn travel_m(&self) -> f64 {
        self.along_m.last().copied().unwrap_or(0.0)
    }
}

/// Length of the longest segment of a path, metres.
fn longest_m(path: &RunPath) -> f64 {
    let starts = path.segments.starts.iter().map(|&start| path.along_m[start]);
    let ends = starts.clone().skip(1).chain([path.segments.travel_m]);
    starts.zip(ends).map(|(start_m, end_m)| end_m - start_m).fold(0.0, f64::max)
}

/// The middle value; the mean of the two middle ones of an even number; 0 of none.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    match values.as_slice() {
        [] => 0.0,
        v if v.len() % 2 == 1 => v[v.len() / 2],
        v => 0.5 * (v[v.len() / 2 - 1] + v[v.len() / 2]),
    }
}
