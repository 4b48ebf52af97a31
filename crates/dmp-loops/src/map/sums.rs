//! What is summed up of a map, and its scores.

use dmp_reduce::{Basis, Confidence, Estimate, FrameSums, Interval, Layout, Reducer, Scales};

use crate::LoopError;

/// Which of the scales of `R_near` ranks loops: 2 m on a drive.
pub(super) const LOOPS: usize = 1;

/// Scores of a map.
#[derive(Debug, Clone, PartialEq)]
pub struct MapScores {
    /// R_near at 5, 2 and 0.5 m, square metres, each with its 99 % interval where there is one; lower is better. `None`
    /// where the map predicts no return.
    pub r_near_m2: [(f64, Option<Estimate>); 3],
    /// `R_near(2 m)` less that of the graph without the candidate, over the returns that both maps predict; negative where
    /// the map became better.
    pub change: Option<Estimate>,
    /// Share of the rays that were cast anew, the others end where nothing moved.
    pub cast_share: f64,
}

impl MapScores {
    /// `R_near(2 m)`, by which loops are ranked, square metres.
    pub fn ranked_m2(&self) -> Option<f64> {
        self.r_near_m2[LOOPS].1.map(|estimate| estimate.value_m2)
    }
}

/// The sums of a map and of another one beside it, stretch by stretch.
pub(super) struct Sums {
    reducer: Reducer,
    /// Of the current stretch.
    pub(super) frame: FrameSums,
    stretch: Option<usize>,
}

impl Sums {
    /// Of a map with these scales and stretches.
    pub(super) fn new(scales: Scales, stretches: usize) -> Self {
        let layout = Layout::new(stretches as u64, vec![Basis::Near; 2]).on_scales(scales);
        let frame = FrameSums::on_scales(layout.bases(), scales);
        Self { reducer: Reducer::new(layout), frame, stretch: None }
    }

    /// What comes is of this stretch; none comes twice.
    pub(super) fn enter(&mut self, stretch: usize) -> Result<(), LoopError> {
        if self.stretch != Some(stretch) {
            self.leave()?;
            self.stretch = Some(stretch);
        }
        Ok(())
    }

    /// Ends the current stretch.
    pub(super) fn leave(&mut self) -> Result<(), LoopError> {
        if let Some(stretch) = self.stretch.take() {
            self.reducer.add_frame(stretch as u64, &self.frame)?;
            self.frame.clear();
        }
        Ok(())
    }

    /// Adds other stretches that have ended.
    pub(super) fn merge(&mut self, other: &Self) -> Result<(), LoopError> {
        Ok(self.reducer.merge(&other.reducer)?)
    }

    pub(super) fn score(&self, cast_share: f64) -> MapScores {
        let scales = self.reducer.compare(0, 1, Confidence::P99).scales;
        // There it is the first less the second.
        let change = scales.get(LOOPS).and_then(|scale| scale.difference).map(negative);
        MapScores { r_near_m2: self.reducer.scores(1, Confidence::P99).r_near_m2, change, cast_share }
    }
}

fn negative(estimate: Estimate) -> Estimate {
    let interval = estimate.interval.map(|interval| Interval {
        low_m2: -interval.high_m2,
        high_m2: -interval.low_m2,
        ..interval
    });
    Estimate { value_m2: -estimate.value_m2, interval, ..estimate }
}
