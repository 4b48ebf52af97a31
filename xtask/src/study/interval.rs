//! The documented intervals once more, in plain floating point: the study does not take them from the
//! reducer it judges.

use dmp_reduce::Confidence;

use super::observe::Both;
use super::result::{Batch, Difference};

/// So many parts have the frames.
pub(super) const BATCHES: usize = 20;

/// Mean over returns and half its 99 % interval, from the totals of consecutive frames (docs/metric.md).
pub(super) fn difference(frames: &[Both]) -> Option<Difference> {
    let (sum, returns) = frames.iter().fold((0.0, 0.0), |(s, n), f| (s + f.difference_m2, n + f.returns));
    if returns == 0.0 {
        return None;
    }
    let value_m2 = sum / returns;
    let used: Vec<Batch> = frames.iter().map(Batch::from).filter(|f| f.returns > 0.0).collect();
    let mut of_batches = parts(frames, (frames.len() / 2).clamp(2, BATCHES));
    of_batches.retain(|batch| batch.returns > 0.0);
    let half_width_m2 = (used.len() >= 4 && of_batches.len() >= 2)
        .then(|| half_width(&used, value_m2, returns).max(half_width(&of_batches, value_m2, returns)));
    Some(Difference { value_m2, half_width_m2 })
}

fn half_width(units: &[Batch], mean_m2: f64, returns: f64) -> f64 {
    let count = units.len() as f64;
    let squares: f64 = units.iter().map(|unit| (unit.difference_m2 - mean_m2 * unit.returns).powi(2)).sum();
    Confidence::P99.student_t(units.len() as u64 - 1) * (count / (count - 1.0) * squares).sqrt() / returns
}

/// The frames in so many consecutive parts.
pub(super) fn parts(frames: &[Both], count: usize) -> Vec<Batch> {
    let mut parts = vec![Batch::default(); count];
    for (k, frame) in frames.iter().enumerate() {
        let part = &mut parts[k * count / frames.len()];
        part.difference_m2 += frame.difference_m2;
        part.level_m2 += frame.level_m2;
        part.returns += frame.returns;
    }
    parts
}

impl From<&Both> for Batch {
    fn from(both: &Both) -> Self {
        Self { difference_m2: both.difference_m2, level_m2: both.level_m2, returns: both.returns }
    }
}
