//! The sums of an evaluation.

use std::sync::{Mutex, PoisonError};

use dmp::{Basis, FrameSums, Scales, Sink};
use dmp_reduce::{Layout, Reducer};

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
        // A frame that does not fit would show in the counts: none is excluded.
        if let Err(error) = reducer.add_frame(frame as u64, sums) {
            eprintln!("scan {frame}: {error}");
        }
    }
}
