//! What is known of a scored scan.

use dmp_reduce::{Basis, RunSums, Scales};

use crate::text::digits;

/// Truncations τ by which places are judged, metres: the first sees centimetres, the second tells a large error from a
/// larger one. 0.5 and 2 m on a drive; in a room a tenth of that, which tells millimetres and decimetres.
pub(crate) const fn judged_by_m(scales: Scales) -> [f64; 2] {
    let [_, wide_m, fine_m] = scales.lengths().near_m;
    [fine_m, wide_m]
}

/// Decimals of lengths of the way, metres: none on a drive, decimetres in a room.
pub(crate) fn metre_decimals(scales: Scales) -> usize {
    usize::from(scales.lengths().metre_m < 1.0)
}

/// A scored scan.
#[derive(Debug, Clone, PartialEq)]
pub struct SeenFrame {
    /// Its number in the log, from 0.
    pub number: usize,
    /// Its stamp, nanoseconds; `None` in a log without stamps.
    pub stamp_ns: Option<i64>,
    /// For every run, the sensor's position at the stamp, metres in the world of the run.
    pub position_in_world_m: Vec<[f64; 3]>,
    /// For every run, its sums.
    pub scores: Vec<FrameScore>,
}

/// The sums of one run over some returns. Of a fused map they are those of `R_cv`, of a map that was given those of
/// `R_near`; and of a fused map those of `R_near` at the finer scale beside them. The scales are 0.5 and 2 m, in a room 0.05 and 0.2 m.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct FrameScore {
    /// Returns that the map predicts.
    pub(crate) predicted: u64,
    /// Σ min(r², τ²)/τ² over them, at either scale.
    pub(crate) parts: [f64; 2],
    /// Returns whose ray crosses a surfel of a fused map, and the same of z − zn over them at the finer scale.
    pub(crate) near: (u64, f64),
}

impl FrameScore {
    /// What the sums of a run, which are of a log of this kind, say on `basis`.
    pub fn of(sums: &RunSums, basis: Basis, scales: Scales) -> Self {
        let near = sums.r_near_m2();
        let crossed = if basis == Basis::CrossValidated { sums.with_first() } else { 0 };
        let (predicted, scores) = match basis {
            Basis::CrossValidated => {
                // The price of a miss is in the first scale alone.
                (sums.with_independent(), sums.r_cv_m2(dmp_reduce::MissPrice::default()).to_vec())
            }
            Basis::Near => (sums.with_first(), near.to_vec()),
        };
        let part_at = |scores: &[(f64, Option<f64>)], scale_m: f64| {
            let mean_m2 = scores.iter().find(|(at_m, _)| *at_m == scale_m).and_then(|(_, mean)| *mean);
            mean_m2.unwrap_or(0.0) / (scale_m * scale_m)
        };
        let judged_by_m = judged_by_m(scales);
        let parts = judged_by_m.map(|scale_m| part_at(&scores, scale_m) * predicted as f64);
        Self { predicted, parts, near: (crossed, part_at(&near, judged_by_m[0]) * crossed as f64) }
    }

    pub(crate) fn add(&mut self, other: &Self) {
        self.predicted += other.predicted;
        for (sum, part) in self.parts.iter_mut().zip(other.parts) {
            *sum += part;
        }
        self.near.0 += other.near.0;
        self.near.1 += other.near.1;
    }

    /// The roots of the means of min(r², τ²) at both τ, metres: 0.5 and 2 m, in a room 0.05 and 0.2 m; `None` where nothing is
    /// predicted.
    pub fn rms_m(&self, scales: Scales) -> Option<[f64; 2]> {
        let rms_m =
            |scale: usize| (self.parts[scale] / self.predicted as f64).sqrt() * judged_by_m(scales)[scale];
        (self.predicted > 0).then(|| [0, 1].map(rms_m))
    }

    /// By how much returns are missed at both scales.
    pub(crate) fn misses(&self, scales: Scales) -> String {
        match self.rms_m(scales) {
            Some([fine_m, wide_m]) => {
                format!("{} and {} cm", digits(100.0 * fine_m), digits(100.0 * wide_m))
            }
            None => "–".to_owned(),
        }
    }

    /// How wrong the map is, from 0 to 3: at each scale, and for the nearest surfel at the finer one, the mean in parts of
    /// its largest value τ².
    ///
    /// The nearest surfel is there to tell passes apart. Where two passes disagree, each is predicted badly by the other;
    /// but the one that is off is off from the scans before and after it too, and so from surfels of its own.
    pub(crate) fn wrongness(&self) -> f64 {
        let mean = |sum: f64, count: u64| sum / count.max(1) as f64;
        self.parts.iter().map(|sum| mean(*sum, self.predicted)).sum::<f64>() + mean(self.near.1, self.near.0)
    }
}

/// One of the returns that are drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampledReturn {
    /// Where it lies, from the sensor's position at the scan's stamp, along the axes of the run's world, metres.
    pub from_sensor_m: [f32; 3],
    /// Unit vector of its ray: while a scan lasts, the sensor moves on.
    pub direction: [f32; 3],
    /// z − z′, measured minus predicted range, metres; `None` where nothing predicts it.
    pub residual_m: Option<f32>,
    /// Whether another visit predicts it.
    pub revisited: bool,
}

impl SampledReturn {
    /// Bytes of [`Self::to_bytes`].
    pub const BYTES: usize = 29;

    /// What [`Self::of_bytes`] reads.
    pub fn to_bytes(&self) -> [u8; Self::BYTES] {
        let mut bytes = [0; Self::BYTES];
        let ([x, y, z], [dx, dy, dz]) = (self.from_sensor_m, self.direction);
        let numbers = [x, y, z, dx, dy, dz, self.residual_m.unwrap_or(f32::NAN)];
        for (place, number) in bytes.as_chunks_mut().0.iter_mut().zip(numbers) {
            *place = number.to_le_bytes();
        }
        bytes[28] = u8::from(self.revisited);
        bytes
    }

    /// The return of these bytes.
    pub fn of_bytes(bytes: &[u8; Self::BYTES]) -> Self {
        let number = |k: usize| f32::from_le_bytes(std::array::from_fn(|byte| bytes[4 * k + byte]));
        Self {
            from_sensor_m: [number(0), number(1), number(2)],
            direction: [number(3), number(4), number(5)],
            residual_m: Some(number(6)).filter(|m| m.is_finite()),
            revisited: bytes[28] != 0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dmp_reduce::Residuals;

    #[test]
    fn sums_of_frames_give_the_scores_of_the_table() {
        let mut sums = RunSums::default();
        for residual_m in [0.1, -0.4, 0.7, 3.0] {
            sums.add(&Residuals::all(residual_m));
        }
        sums.add(&Residuals::MISS);
        for (basis, mean) in [
            (Basis::CrossValidated, sums.r_cv_m2(dmp_reduce::MissPrice::default())[2].1),
            (Basis::Near, sums.r_near_m2()[2].1),
        ] {
            let score = FrameScore::of(&sums, basis, Scales::Drive);
            assert_eq!(score.predicted, 4);
            assert!((score.rms_m(Scales::Drive).unwrap()[0] - mean.unwrap().sqrt()).abs() < 1e-12);
            let at_half = (0.01 + 0.16 + 0.25 + 0.25) / 4.0 / 0.25;
            let twice = if basis == Basis::CrossValidated { 2.0 } else { 1.0 };
            let by_hand = twice * at_half + (0.01 + 0.16 + 0.49 + 4.0) / 4.0 / 4.0;
            assert!((score.wrongness() - by_hand).abs() < 1e-9, "{} {by_hand}", score.wrongness());
        }
        assert_eq!(FrameScore::default().rms_m(Scales::Drive), None);
        assert_eq!(FrameScore::default().wrongness(), 0.0);
    }

    #[test]
    fn returns_keep_their_bits() {
        for residual_m in [None, Some(-0.25)] {
            let sampled = SampledReturn {
                from_sensor_m: [1.5, -2.0, 1e-3],
                direction: [0.0, 0.6, -0.8],
                residual_m,
                revisited: residual_m.is_some(),
            };
            assert_eq!(SampledReturn::of_bytes(&sampled.to_bytes()), sampled);
        }
    }
}
