use crate::fixed::{FixedSum, units_to_m2};
use crate::student::Confidence;
use crate::wide::Wide;

/// Batches of consecutive frames an interval over all frames is taken from.
const BATCHES: u64 = 20;
/// Frames with returns below which there is no interval.
pub(crate) const FRAMES_NEEDED: u64 = 4;

/// All frames that there are, scored or not, in the order of time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Frames(pub(crate) u64);

impl Frames {
    /// Batches for the interval: 20, of at least two frames each; never fewer than two.
    fn batches(self) -> u64 {
        (self.0 / 2).clamp(2, BATCHES)
    }

    /// In which of `parts` equal stretches the frame `ordinal` lies.
    pub(crate) fn part_of(self, ordinal: u64, parts: u64) -> usize {
        (u128::from(ordinal) * u128::from(parts) / u128::from(self.0)) as usize
    }

    /// The first and the last frame of a stretch: those that [`Self::part_of`] puts there. There are no
    /// more `parts` than frames.
    pub(crate) fn part(self, part: u64, parts: u64) -> (u64, u64) {
        let start = |part: u64| (u128::from(part) * u128::from(self.0)).div_ceil(parts.into()) as u64;
        (start(part), start(part + 1) - 1)
    }
}

/// What an interval is asked for: of how many frames how many were scored, and how sure it is to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Asked {
    pub(crate) scored: u64,
    pub(crate) frames: Frames,
    pub(crate) confidence: Confidence,
}

impl Asked {
    /// Share of the frames that were not scored.
    pub(crate) fn left_share(self) -> f64 {
        1.0 - self.scored as f64 / self.frames.0 as f64
    }

    pub(crate) fn is_sample(self) -> bool {
        self.scored < self.frames.0
    }
}

/// The sum of a quantity in units of 2^-40 m², and over how many returns.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub(crate) struct Total {
    pub(crate) sum: i128,
    pub(crate) returns: u64,
}

impl Total {
    pub(crate) fn add(&mut self, other: Self) {
        self.sum += other.sum;
        self.returns += other.returns;
    }

    /// Square metres; `None` over nothing.
    pub(crate) fn mean_m2(self) -> Option<f64> {
        FixedSum::from_units(self.sum).mean_m2(self.returns)
    }
}

/// A mean over returns with its error: what is kept of the frames for the ratio estimator D = ΣΔ / ΣN,
/// where a frame has the total Δ over N returns.
///
/// # Why nothing overflows
/// A truncated square, and the difference of two, is below 2^50 units. A frame has at most 2^32 and all
/// frames together at most 2^44 returns (the reducer refuses more), so
/// |ΣΔ| < 2^94, ΣN² ≤ 2^76 and |ΣΔN| < 2^126 fit an `i128`, and ΣΔ² < 2^176 a [`Wide`].
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub(crate) struct Ratio {
    total: Total,
    batches: [Total; BATCHES as usize],
    frames: FrameMoments,
}

/// Second moments of the frames that have returns.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
struct FrameMoments {
    frames: u64,
    /// ΣΔ²
    sums_square: Wide,
    /// ΣΔN
    cross: i128,
    /// ΣN²
    returns_square: i128,
}

/// From what an interval was taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum IntervalFrom {
    /// Batches of consecutive frames: neighbouring frames are alike.
    Batches,
    /// Single frames, where they differ more than batches do.
    Frames,
    /// Single frames of a sample: the error of sampling, against the score over all frames.
    SampledFrames,
}

/// An interval, both ends included: at 99 % where no other confidence was asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// Lower end, square metres.
    pub low_m2: f64,
    /// Upper end, square metres.
    pub high_m2: f64,
    /// Degrees of freedom of Student's distribution.
    pub degrees: u64,
    /// From what it was taken.
    pub from: IntervalFrom,
}

impl Interval {
    /// Whether 0 lies outside. An interval without width, as of a difference that is the same
    /// everywhere, excludes 0 unless it is 0.
    pub fn excludes_zero(&self) -> bool {
        self.low_m2 > 0.0 || self.high_m2 < 0.0
    }
}

/// A mean over returns with its interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// The mean, square metres.
    pub value_m2: f64,
    /// Over how many returns.
    pub returns: u64,
    /// Its interval; `None` where fewer than four frames have returns, or where, over all frames,
    /// all returns lie in one batch.
    pub interval: Option<Interval>,
}

impl Ratio {
    /// Adds one frame. Each frame once.
    pub(crate) fn add_frame(&mut self, ordinal: u64, frame: Total, frames: Frames) {
        if frame.returns == 0 {
            return;
        }
        self.total.add(frame);
        self.batches[frames.part_of(ordinal, frames.batches())].add(frame);
        let returns = i128::from(frame.returns);
        self.frames.frames += 1;
        self.frames.sums_square += Wide::product(frame.sum, frame.sum);
        self.frames.cross += frame.sum * returns;
        self.frames.returns_square += returns * returns;
    }

    pub(crate) fn merge(&mut self, other: &Self) {
        self.total.add(other.total);
        for (mine, theirs) in self.batches.iter_mut().zip(other.batches) {
            mine.add(theirs);
        }
        self.frames.frames += other.frames.frames;
        self.frames.sums_square += other.frames.sums_square;
        self.frames.cross += other.frames.cross;
        self.frames.returns_square += other.frames.returns_square;
    }

    pub(crate) fn total(&self) -> Total {
        self.total
    }

    /// Frames with returns.
    pub(crate) fn frames(&self) -> u64 {
        self.frames.frames
    }

    /// Whether the total of every frame is 0.
    pub(crate) fn is_zero_everywhere(&self) -> bool {
        self.frames.sums_square == Wide::default()
    }

    /// The mean with its interval; `None` over nothing.
    pub(crate) fn estimate(&self, asked: Asked) -> Option<Estimate> {
        let value_m2 = self.total.mean_m2()?;
        let interval = self.half_width(asked).map(|(half_width, degrees, from)| {
            let half_width_m2 = units_to_m2(half_width);
            Interval { low_m2: value_m2 - half_width_m2, high_m2: value_m2 + half_width_m2, degrees, from }
        });
        Some(Estimate { value_m2, returns: self.total.returns, interval })
    }

    /// Half the interval in units, its degrees of freedom and its source.
    fn half_width(&self, asked: Asked) -> Option<(f64, u64, IntervalFrom)> {
        let frames = self.frames.frames;
        if frames < FRAMES_NEEDED {
            return None;
        }
        let of_frames =
            asked.confidence.student_t(frames - 1) * self.standard_error(frames, self.frame_errors());
        if asked.is_sample() {
            let left = asked.left_share();
            return Some((of_frames * left.sqrt(), frames - 1, IntervalFrom::SampledFrames));
        }
        let (batches, errors) = self.batch_errors();
        if batches < 2 {
            return None;
        }
        let of_batches = asked.confidence.student_t(batches - 1) * self.standard_error(batches, errors);
        if of_batches >= of_frames {
            Some((of_batches, batches - 1, IntervalFrom::Batches))
        } else {
            Some((of_frames, frames - 1, IntervalFrom::Frames))
        }
    }

    /// The linearised standard error of a ratio: √(U/(U−1) Σe²) / ΣN over U units (batches or frames)
    /// with the errors e = Δ − D N. Units without returns do not count: e is 0 there whatever is true.
    fn standard_error(&self, units: u64, errors_square: f64) -> f64 {
        let units = units as f64;
        (units / (units - 1.0) * errors_square).sqrt() / self.total.returns as f64
    }

    /// The number of batches with returns and their Σe². Each e is rounded once.
    fn batch_errors(&self) -> (u64, f64) {
        let all = i128::from(self.total.returns);
        let (mut batches, mut errors_square) = (0, 0.0);
        for batch in self.batches.iter().filter(|batch| batch.returns > 0) {
            let scaled = Wide::product(batch.sum, all) - Wide::product(self.total.sum, batch.returns.into());
            let error = scaled.to_f64() / all as f64;
            batches += 1;
            errors_square += error * error;
        }
        (batches, errors_square)
    }

    /// Σe² over the frames, from their moments: ΣΔ² − 2 D ΣΔN + D² ΣN².
    ///
    /// The terms cancel, so the whole part q of D is taken out first, in exact integers; the fraction
    /// that is left, half a unit at most, does no harm in floating point.
    fn frame_errors(&self) -> f64 {
        let FrameMoments { sums_square, cross, returns_square, .. } = self.frames;
        let all = i128::from(self.total.returns);
        let q = (2 * self.total.sum + all).div_euclid(2 * all);
        let fraction = (self.total.sum - q * all) as f64 / all as f64;
        let square = sums_square - Wide::product(2 * q, cross) + Wide::product(q * q, returns_square);
        let cross = (cross - q * returns_square) as f64;
        (square.to_f64() - 2.0 * fraction * cross + fraction * fraction * returns_square as f64).max(0.0)
    }
}

#[cfg(test)]
mod tests;
