//! The documented errors once more, in plain floating point: independent of the reducer that the study checks.

use dmp_reduce::Confidence;

use super::result::{Both, Difference, Said};

/// Parts of the frames that are saved for each place of the guard.
pub(super) const BATCHES_OF_PLACE: usize = 2;

/// Parts of so many frames that are saved: of ten places, fewer where one would have less than twenty frames.
pub(super) fn batch_count(frames: usize) -> usize {
    BATCHES_OF_PLACE * (frames / 20).clamp(1, 10)
}
/// At most so many stretches of the frames are units of independence.
const STRETCHES: usize = 40;

/// The sum of units.
pub(super) fn total(units: &[Both]) -> Both {
    units.iter().fold(Both::default(), |mut total, unit| {
        total.merge(unit);
        total
    })
}

/// The variance of errors of units, and its degrees of freedom.
fn scatter(errors: &[f64]) -> (f64, f64) {
    let count = errors.len() as f64;
    let [squares, fourths]: [f64; 2] = [2, 4].map(|power| errors.iter().map(|e| e.powi(power)).sum());
    let worth = if fourths > 0.0 { 3.0 * squares * squares / fourths - 3.0 } else { f64::INFINITY };
    (count / (count - 1.0) * squares, worth.clamp(1.0, (count - 1.0).max(1.0)))
}

/// The sum of two errors (Satterthwaite 1946).
fn with_error(value_m2: f64, in_time: (f64, f64), on_surfaces: (f64, f64)) -> Difference {
    let variance = in_time.0 + on_surfaces.0;
    let part =
        |(variance, degrees): (f64, f64)| if variance > 0.0 { variance * variance / degrees } else { 0.0 };
    let parts = part(in_time) + part(on_surfaces);
    let degrees = if parts > 0.0 { variance * variance / parts } else { in_time.1.min(on_surfaces.1) };
    Difference { value_m2, error_m2: Some(variance.sqrt()), degrees: degrees as u64 }
}

/// Mean over returns and its error, from the totals of consecutive frames and of groups of surface (docs/metric.md).
pub(super) fn difference(frames: &[Both], groups: &[Both]) -> Option<Difference> {
    let Both { difference_m2, returns, .. } = total(frames);
    if returns == 0.0 {
        return None;
    }
    let value_m2 = difference_m2 / returns;
    let errors = |units: &[Both]| -> Vec<f64> {
        let used = units.iter().filter(|unit| unit.returns > 0.0);
        used.map(|unit| (unit.difference_m2 - value_m2 * unit.returns) / returns).collect()
    };
    let single = errors(frames);
    let stretches = errors(&parts(frames, (frames.len() / 2).clamp(2, STRETCHES)));
    let surfaces = errors(groups);
    let is_known = single.len() >= 4 && stretches.len() >= 2 && surfaces.len() >= 4;
    let of_frames = (scatter(&single).0, single.len() as f64 - 1.0);
    let of_stretches = scatter(&stretches);
    let in_time = if of_stretches.0 >= of_frames.0 { of_stretches } else { of_frames };
    let found = with_error(value_m2, in_time, scatter(&surfaces));
    Some(Difference { error_m2: found.error_m2.filter(|_| is_known), ..found })
}

impl Difference {
    /// Which of two is better, as sure as `confidence`.
    pub(super) fn said(self, confidence: Confidence) -> Said {
        let half_m2 = match self.error_m2 {
            Some(error_m2) if error_m2 > 0.0 => confidence.student_t(self.degrees) * error_m2,
            _ => 0.0,
        };
        match self.value_m2 {
            _ if self.error_m2.is_none() => Said::Nothing,
            value_m2 if value_m2 < -half_m2 => Said::A,
            value_m2 if value_m2 > half_m2 => Said::B,
            _ => Said::Nothing,
        }
    }

    /// The probability of so large a difference by chance.
    pub(super) fn chance(self) -> f64 {
        match self.error_m2 {
            Some(error_m2) if self.value_m2 != 0.0 => {
                Confidence::chance(self.value_m2.abs() / error_m2, self.degrees)
            }
            _ => 1.0,
        }
    }
}

/// The confidence of each of several answers, given their probabilities by chance, so that all together are as sure as
/// 99 % (Holm 1979).
pub(super) fn of_each(chances: &[f64]) -> Confidence {
    let mut answered = 0;
    loop {
        let left = (chances.len() - answered).max(1);
        let found = chances.iter().filter(|&&chance| chance <= 0.01 / left as f64).count();
        if found <= answered {
            return Confidence::P99.of_each_look(left as u32);
        }
        answered = found;
    }
}

/// The frames in so many consecutive parts.
pub(super) fn parts(frames: &[Both], count: usize) -> Vec<Both> {
    let mut parts = vec![Both::default(); count];
    for (k, frame) in frames.iter().enumerate() {
        parts[k * count / frames.len()].merge(frame);
    }
    parts
}
