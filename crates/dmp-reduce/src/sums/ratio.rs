//! A mean over returns with its error and its interval, from integer sums alone.

use crate::numbers::{Confidence, Scatter, Total, Units, Wide, units_to_m2};
use crate::residual::{GROUPS, SurfaceGroup};

/// Stretches of consecutive frames, of at least two frames each.
const STRETCHES: u64 = 40;
/// Frames with returns, and groups of surface with returns, below which there is no interval.
pub(crate) const FRAMES_NEEDED: u64 = 4;
pub(crate) const GROUPS_NEEDED: u64 = 4;

/// All frames that there are, scored or not, in the order of time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Frames(pub(crate) u64);

impl Frames {
    /// Stretches for the interval: 40, of at least two frames each; never fewer than two.
    fn stretches(self) -> u64 {
        (self.0 / 2).clamp(2, STRETCHES)
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

/// A mean over returns with its error: what is kept for the ratio estimator D = ΣΔ / ΣN, where a unit has the total Δ
/// over N returns.
///
/// Neighbouring frames are alike, and all frames that see a piece of surface share its errors. So there are two kinds of
/// units, stretches of time and groups of surface, and the error of D is the sum of what each shows (two-way
/// clustering: Cameron, Gelbach & Miller 2011; what returns scatter by themselves is counted twice, on the safe side).
///
/// # Why nothing overflows
/// A truncated square, and the difference of two, is below 2^50 units. A frame has at most 2^32 and all
/// frames together at most 2^44 returns (the reducer refuses more), so
/// |ΣΔ| < 2^94, ΣN² ≤ 2^76 and |ΣΔN| < 2^126 fit an `i128`, and ΣΔ² < 2^176 a [`Wide`].
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub(crate) struct Ratio {
    total: Total,
    stretches: Units,
    surfaces: Units,
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

/// An interval, both ends included, as sure as was asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// Lower end, square metres.
    pub low_m2: f64,
    /// Upper end, square metres.
    pub high_m2: f64,
    /// Degrees of freedom of Student's distribution.
    pub degrees: u64,
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
    /// Its interval; `None` where fewer than four frames or four groups of surface have returns, or where all lie in
    /// one stretch of the frames.
    pub interval: Option<Interval>,
}

/// A mean with its standard error, square metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Mean {
    pub(crate) value_m2: f64,
    pub(crate) returns: u64,
    /// The standard error, and how many degrees of freedom it is known with.
    pub(crate) error: Option<(f64, u64)>,
}

impl Mean {
    /// With the interval that is as sure as `confidence`.
    pub(crate) fn within(self, confidence: Confidence) -> Estimate {
        let interval = self.error.map(|(error_m2, degrees)| {
            let half_m2 = if error_m2 > 0.0 { confidence.student_t(degrees) * error_m2 } else { 0.0 };
            Interval { low_m2: self.value_m2 - half_m2, high_m2: self.value_m2 + half_m2, degrees }
        });
        Estimate { value_m2: self.value_m2, returns: self.returns, interval }
    }

    /// How likely a difference as large as this is where none is true: the chance that |t| is not below what it is
    /// here. 1 where there is no error to compare with.
    pub(crate) fn chance(self) -> f64 {
        match self.error {
            None => 1.0,
            Some(_) if self.value_m2 == 0.0 => 1.0,
            Some((error_m2, degrees)) => Confidence::chance(self.value_m2.abs() / error_m2, degrees),
        }
    }
}

impl Default for Ratio {
    fn default() -> Self {
        Self {
            total: Total::default(),
            stretches: Units::new(STRETCHES as usize),
            surfaces: Units::new(GROUPS),
            frames: FrameMoments::default(),
        }
    }
}

impl Ratio {
    /// Adds one frame, of which each group of surface has a total. Each frame once.
    pub(crate) fn add_frame(
        &mut self,
        ordinal: u64,
        frames: Frames,
        by_surface: impl Iterator<Item = (SurfaceGroup, Total)>,
    ) {
        let mut frame = Total::default();
        for (group, total) in by_surface {
            frame.add(total);
            self.surfaces.add(group.index(), total);
        }
        if frame.returns == 0 {
            return;
        }
        self.total.add(frame);
        self.stretches.add(frames.part_of(ordinal, frames.stretches()), frame);
        let returns = i128::from(frame.returns);
        self.frames.frames += 1;
        self.frames.sums_square += Wide::product(frame.sum, frame.sum);
        self.frames.cross += frame.sum * returns;
        self.frames.returns_square += returns * returns;
    }

    pub(crate) fn merge(&mut self, other: &Self) {
        self.total.add(other.total);
        self.stretches.merge(&other.stretches);
        self.surfaces.merge(&other.surfaces);
        self.frames.frames += other.frames.frames;
        self.frames.sums_square += other.frames.sums_square;
        self.frames.cross += other.frames.cross;
        self.frames.returns_square += other.frames.returns_square;
    }

    /// Whether it has the units that one made here has: what comes from elsewhere may not.
    pub(crate) fn is_whole(&self) -> bool {
        (self.stretches.len(), self.surfaces.len()) == (STRETCHES as usize, GROUPS)
    }

    pub(crate) fn total(&self) -> Total {
        self.total
    }

    /// Frames with returns.
    pub(crate) fn frames(&self) -> u64 {
        self.frames.frames
    }

    /// Groups of surface with returns.
    pub(crate) fn groups(&self) -> u64 {
        self.surfaces.occupied()
    }

    /// The mean with its error; `None` over nothing.
    pub(crate) fn mean(&self) -> Option<Mean> {
        let value_m2 = self.total.mean_m2()?;
        let error = self.scatter().map(|scatter| {
            let error_m2 = units_to_m2(scatter.variance.sqrt() / self.total.returns as f64);
            (error_m2, scatter.degrees as u64)
        });
        Some(Mean { value_m2, returns: self.total.returns, error })
    }

    /// What stretches or single frames scatter, whichever is more, and groups of surface.
    fn scatter(&self) -> Option<Scatter> {
        let frames = self.frames.frames;
        if frames < FRAMES_NEEDED {
            return None;
        }
        let of_frames = Scatter::of(frames, self.frame_errors());
        let (of_stretches, of_surfaces) =
            (self.stretches.scatter(self.total), self.surfaces.scatter(self.total));
        if of_stretches.units < 2 || of_surfaces.units < GROUPS_NEEDED {
            return None;
        }
        let in_time = if of_stretches.variance >= of_frames.variance { of_stretches } else { of_frames };
        Some(in_time.and(of_surfaces))
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
