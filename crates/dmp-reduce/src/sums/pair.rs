//! What is kept of a pair of runs over all frames.

use super::frame::{FrameSums, PairSums};
use super::ratio::{Frames, Ratio};
use crate::numbers::{FixedSum, Total};
use crate::residual::{Basis, Scales};

/// Stretches of the log that the place guard looks at.
const PLACES: u64 = 10;

/// What a reducer keeps of a pair of runs: the sums over their common returns, scale by scale.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub(crate) struct PairTotals {
    pub(crate) basis: Basis,
    /// As [`Basis::scales_m`].
    pub(crate) scales: Vec<ScaleTotals>,
}

/// A pair at one scale. The difference is a − b: negative where a is better.
#[derive(Debug, Clone, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub(crate) struct ScaleTotals {
    pub(crate) difference: Ratio,
    pub(crate) a: FixedSum,
    pub(crate) b: FixedSum,
    /// The difference in up to ten consecutive stretches, see [`place_count`].
    pub(crate) places: [Total; PLACES as usize],
}

/// A place has at least so many frames: fewer differ by chance, wherever segments end.
const PLACE_FRAMES: u64 = 20;

/// Into how many places the frames are cut.
pub(crate) fn place_count(frames: Frames) -> u64 {
    (frames.0 / PLACE_FRAMES).clamp(1, PLACES)
}

impl PairTotals {
    pub(crate) fn new(basis: Basis) -> Self {
        Self { basis, scales: vec![ScaleTotals::default(); basis.scales_m(Scales::default()).len()] }
    }

    /// Its differences, scale by scale.
    pub(crate) fn ratios(&self) -> impl Iterator<Item = &Ratio> {
        self.scales.iter().map(|scale| &scale.difference)
    }

    /// Adds the `index`-th pair of a frame.
    pub(crate) fn add_frame(
        &mut self,
        ordinal: u64,
        index: usize,
        pair: &PairSums,
        sums: &FrameSums,
        frames: Frames,
    ) {
        if pair.returns() == 0 {
            return;
        }
        let place = frames.part_of(ordinal, place_count(frames));
        for (k, scale) in self.scales.iter_mut().enumerate() {
            let (a, b) = pair.at(k);
            scale.difference.add_frame(ordinal, frames, sums.differences(index, k));
            scale.places[place].add(Total { sum: a.units() - b.units(), returns: pair.returns() });
            scale.a += a;
            scale.b += b;
        }
    }

    pub(crate) fn merge(&mut self, other: &Self) {
        for (mine, theirs) in self.scales.iter_mut().zip(&other.scales) {
            mine.difference.merge(&theirs.difference);
            for (mine, theirs) in mine.places.iter_mut().zip(theirs.places) {
                mine.add(theirs);
            }
            mine.a += theirs.a;
            mine.b += theirs.b;
        }
    }
}
