//! The documented intervals once more, in plain floating point: the study does not take them from the
//! reducer it judges.

use dmp_reduce::student_t_99;

use super::observe::Sum;
use super::result::Difference;

const BATCHES: usize = 20;

/// Mean over returns and half its 99 % interval, from the totals of consecutive frames (docs/metric.md).
pub(super) fn difference(frames: &[Sum]) -> Option<Difference> {
    let (sum, returns) = frames.iter().fold((0.0, 0.0), |(s, n), f| (s + f.sum_m2, n + f.returns));
    if returns == 0.0 {
        return None;
    }
    let value_m2 = sum / returns;
    let used: Vec<Sum> = frames.iter().copied().filter(|f| f.returns > 0.0).collect();
    let batches = (frames.len() / 2).clamp(2, BATCHES);
    let mut of_batches = vec![Sum::default(); batches];
    for (k, frame) in frames.iter().enumerate() {
        let batch = &mut of_batches[k * batches / frames.len()];
        batch.sum_m2 += frame.sum_m2;
        batch.returns += frame.returns;
    }
    of_batches.retain(|batch| batch.returns > 0.0);
    let half_width_m2 = (used.len() >= 4 && of_batches.len() >= 2)
        .then(|| half_width(&used, value_m2, returns).max(half_width(&of_batches, value_m2, returns)));
    Some(Difference { value_m2, half_width_m2 })
}

fn half_width(units: &[Sum], mean_m2: f64, returns: f64) -> f64 {
    let count = units.len() as f64;
    let squares: f64 = units.iter().map(|unit| (unit.sum_m2 - mean_m2 * unit.returns).powi(2)).sum();
    student_t_99(units.len() as u64 - 1) * (count / (count - 1.0) * squares).sqrt() / returns
}

/// Mean difference in each of ten consecutive parts of the frames over the mean level of both runs.
pub(super) fn places(differences: &[Sum], levels_m2: impl Iterator<Item = f64>) -> Vec<f64> {
    let total_level: f64 = levels_m2.sum();
    let returns: f64 = differences.iter().map(|frame| frame.returns).sum();
    let level_m2 = 0.5 * total_level / returns.max(1.0);
    let parts = differences.len().min(10);
    let mut sums = vec![Sum::default(); parts];
    for (k, frame) in differences.iter().enumerate() {
        let part = &mut sums[k * parts / differences.len()];
        part.sum_m2 += frame.sum_m2;
        part.returns += frame.returns;
    }
    let filled = sums.iter().filter(|part| part.returns > 0.0);
    filled.map(|part| part.sum_m2 / part.returns / level_m2.max(f64::MIN_POSITIVE)).collect()
}
