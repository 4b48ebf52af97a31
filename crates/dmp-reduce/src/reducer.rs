//! The frames of a log, in any order, into sums whose size does not depend on their number.

use crate::error::ReduceError;
use crate::numbers::{FixedSum, Total};
use crate::residual::{Basis, CV, GROUPS, MissPrice, NEAR, Scales, WIDEST};
use crate::sums::{FrameSet, FrameSums, Frames, PairTotals, Ratio, RunSums, pairs_of};

/// Most returns of one frame, and of all frames, for which no sum can overflow.
const FRAME_RETURNS: u64 = 1 << 32;
const ALL_RETURNS: u64 = 1 << 44;

/// The layout of a [`Reducer`]: how many frames there are, and the runs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Layout {
    pub(crate) frames: Frames,
    pub(crate) bases: Vec<Basis>,
    pub(crate) miss_price: MissPrice,
    pub(crate) scales: Scales,
}

impl Layout {
    /// The layout of `frames` frames, numbered from 0 in the order of time, for runs judged by `bases`
    /// on the scales of a LiDAR.
    pub fn new(frames: u64, bases: Vec<Basis>) -> Self {
        Self { frames: Frames(frames), bases, miss_price: MissPrice::default(), scales: Scales::default() }
    }

    /// With another price of a return that has no independent crossing.
    #[must_use]
    pub fn with_miss_price(self, miss_price: MissPrice) -> Self {
        Self { miss_price, ..self }
    }

    /// With other lengths by which returns are judged.
    #[must_use]
    pub fn on_scales(self, scales: Scales) -> Self {
        Self { scales, ..self }
    }

    /// The lengths by which returns are judged.
    pub fn scales(&self) -> Scales {
        self.scales
    }

    /// What a return without an independent crossing costs.
    pub fn miss_price(&self) -> MissPrice {
        self.miss_price
    }

    /// Frames that there are.
    pub fn frames(&self) -> u64 {
        self.frames.0
    }

    /// By what each run is judged.
    pub fn bases(&self) -> &[Basis] {
        &self.bases
    }
}

/// Takes the frames of a log, in any order and split over any number of reducers, and scores the
/// whole. Its size depends on the number of runs alone, and its sums are integers: whichever way the
/// frames came in, the answers have the same bits.
///
/// Every frame is to be added once, a frame without returns too; one that comes twice is refused, also where two reducers
/// have it. Where not all were added, they are assumed to be a sample that is spread evenly over the log.
///
/// It holds a bit for each frame, and of R runs 64 integer totals for each of their scores and for each truncation of their R (R − 1) / 2 pairs,
/// see [`Self::bytes_of`]; a frame takes time in proportion to as many.
///
/// ```
/// use dmp_reduce::{Basis, FrameSums, Layout, Reducer, Residuals};
///
/// let layout = Layout::new(4, vec![Basis::CrossValidated; 2]);
/// let mut frame = FrameSums::new(layout.bases());
/// frame.add_return(&[Residuals::all(0.1), Residuals::all(0.3)]);
/// // Two threads have two reducers; merged, they are what one would be.
/// let [mut first, mut second, mut one] = [0; 3].map(|_| Reducer::new(layout.clone()));
/// for ordinal in 0..4 {
///     let half = if ordinal < 2 { &mut first } else { &mut second };
///     half.add_frame(ordinal, &frame)?;
///     one.add_frame(ordinal, &frame)?;
/// }
/// second.merge(&first)?;
/// assert_eq!(second, one);
/// # Ok::<(), dmp_reduce::ReduceError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reducer {
    pub(crate) layout: Layout,
    pub(crate) frames: FrameSet,
    pub(crate) runs: Vec<RunTotals>,
    pub(crate) pairs: Vec<PairTotals>,
}

/// What a reducer has seen, without its layout: to be put down and taken up again by another process.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Seen {
    frames: FrameSet,
    runs: Vec<RunTotals>,
    pairs: Vec<PairTotals>,
}

/// What is kept of one run.
#[derive(Debug, Clone, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub(crate) struct RunTotals {
    pub(crate) sums: RunSums,
    pub(crate) cv: [Ratio; CV - WIDEST],
    pub(crate) near: [Ratio; NEAR],
}

impl Reducer {
    /// Memory of a reducer of `runs` runs, bytes.
    pub fn bytes_of(runs: usize) -> usize {
        let scores = runs * (CV - WIDEST + NEAR) + pairs_of(runs).count() * CV;
        scores * 2 * GROUPS * size_of::<Total>()
    }

    /// A reducer that has seen no frame.
    pub fn new(layout: Layout) -> Self {
        let bases = &layout.bases;
        let pairs = pairs_of(bases.len()).map(|(a, b)| PairTotals::new(bases[a].of_pair(bases[b])));
        Self {
            frames: FrameSet::default(),
            runs: vec![RunTotals::default(); bases.len()],
            pairs: pairs.collect(),
            layout,
        }
    }

    /// What it has seen so far.
    pub fn seen(&self) -> Seen {
        Seen { frames: self.frames.clone(), runs: self.runs.clone(), pairs: self.pairs.clone() }
    }

    /// A reducer that has seen what another of the same layout had.
    ///
    /// # Errors
    /// When `seen` is of other runs than the layout, or of more frames or returns than it has.
    pub fn resume(layout: Layout, seen: Seen) -> Result<Self, ReduceError> {
        let empty = Self::new(layout);
        let basis =
            |pairs: &[PairTotals]| pairs.iter().map(|p| (p.basis, p.scales.len())).collect::<Vec<_>>();
        let other_scales = |run: &RunTotals| run.sums.are_on_other_than(empty.layout.scales);
        let other_runs = seen.runs.len() != empty.runs.len() || basis(&seen.pairs) != basis(&empty.pairs);
        let ratios = seen.runs.iter().flat_map(|run| run.cv.iter().chain(&run.near));
        let is_cut = ratios.chain(seen.pairs.iter().flat_map(PairTotals::ratios)).any(|r| !r.is_whole());
        if other_runs || is_cut || seen.runs.iter().any(other_scales) {
            return Err(ReduceError::OtherRuns);
        }
        let resumed =
            Self { frames: seen.frames, runs: seen.runs, pairs: seen.pairs, layout: empty.layout.clone() };
        empty.check_returns(resumed.returns())?;
        match resumed.frames.last().map(|last| last as u64) {
            Some(ordinal) if ordinal >= empty.layout.frames.0 => {
                Err(ReduceError::NoSuchFrame { ordinal, frames: empty.layout.frames.0 })
            }
            _ => Ok(resumed),
        }
    }

    /// Adds the frame that is the `ordinal`-th of all.
    ///
    /// # Errors
    /// When the layout has no such frame, or other runs; when the frame was added before; when the returns are too many.
    /// Nothing is added then.
    pub fn add_frame(&mut self, ordinal: u64, frame: &FrameSums) -> Result<(), ReduceError> {
        let frames = self.layout.frames;
        if ordinal >= frames.0 {
            return Err(ReduceError::NoSuchFrame { ordinal, frames: frames.0 });
        }
        if frame.bases() != self.layout.bases || frame.scales() != self.layout.scales {
            return Err(ReduceError::OtherRuns);
        }
        let runs = frame.runs();
        // A run lacks returns for which it has no pose.
        let returns = runs.iter().map(RunSums::returns).max().unwrap_or(0);
        self.check_returns(returns)?;
        if returns > FRAME_RETURNS {
            return Err(ReduceError::TooManyReturns);
        }
        if !self.frames.insert(ordinal as usize) {
            return Err(ReduceError::FrameTwice { ordinal });
        }
        for (index, (totals, sums)) in self.runs.iter_mut().zip(&runs).enumerate() {
            totals.sums.merge(sums);
            totals.add_groups(ordinal, index, frame, &self.layout);
        }
        for (index, (totals, pair)) in self.pairs.iter_mut().zip(frame.pair_sums()).enumerate() {
            totals.add_frame(ordinal, index, &pair, frame, frames);
        }
        Ok(())
    }

    /// Adds `count` frames without returns, in places that no frame has: which these are changes no sum.
    ///
    /// # Errors
    /// When the layout has no room for as many. Those that there is room for are added then.
    pub fn add_empty_frames(&mut self, count: u64) -> Result<(), ReduceError> {
        let (mut left, frames) = (count, self.layout.frames.0);
        for ordinal in 0..frames {
            if left == 0 {
                return Ok(());
            }
            left -= u64::from(self.frames.insert(ordinal as usize));
        }
        if left == 0 { Ok(()) } else { Err(ReduceError::NoSuchFrame { ordinal: frames, frames }) }
    }

    /// Adds what another reducer of the same layout has seen.
    ///
    /// # Errors
    /// When the layouts differ, both have seen the same frame, or the two together hold more returns than one may. Nothing is
    /// added then.
    pub fn merge(&mut self, other: &Self) -> Result<(), ReduceError> {
        if self.layout != other.layout {
            return Err(ReduceError::OtherLayout);
        }
        self.check_returns(other.returns())?;
        if let Some(ordinal) = self.frames.first_in_common(&other.frames) {
            return Err(ReduceError::FrameTwice { ordinal: ordinal as u64 });
        }
        self.frames.merge(&other.frames);
        for (mine, theirs) in self.runs.iter_mut().zip(&other.runs) {
            mine.merge(theirs);
        }
        for (mine, theirs) in self.pairs.iter_mut().zip(&other.pairs) {
            mine.merge(theirs);
        }
        Ok(())
    }

    fn check_returns(&self, returns: u64) -> Result<(), ReduceError> {
        if returns > ALL_RETURNS - self.returns() {
            return Err(ReduceError::TooManyReturns);
        }
        Ok(())
    }

    fn returns(&self) -> u64 {
        self.runs.iter().map(|run| run.sums.returns()).max().unwrap_or(0)
    }

    /// Its layout.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Frames seen so far; the answers are for the whole when it is [`Layout::frames`].
    pub fn frames_added(&self) -> u64 {
        self.frames.len()
    }

    /// Which these are.
    pub fn frames(&self) -> &FrameSet {
        &self.frames
    }

    /// The sums of the `run`-th run.
    ///
    /// # Panics
    /// Where there is no such run.
    pub fn sums(&self, run: usize) -> &RunSums {
        &self.runs[run].sums
    }
}

impl RunTotals {
    fn add_groups(&mut self, ordinal: u64, run: usize, frame: &FrameSums, layout: &Layout) {
        let groups: Vec<_> = frame.groups_of_run(run).collect();
        let add = |ratio: &mut Ratio, of_group: &dyn Fn(&RunSums) -> (FixedSum, u64)| {
            let total = |sums: &RunSums| {
                let (sum, returns) = of_group(sums);
                Total { sum: sum.units(), returns }
            };
            let groups = groups.iter().map(|(group, sums)| (*group, total(sums)));
            ratio.add_frame(ordinal, layout.frames, groups);
        };
        for (k, ratio) in self.cv.iter_mut().enumerate() {
            add(ratio, &|sums| sums.cv_ratio(WIDEST + k, layout.miss_price));
        }
        for (k, ratio) in self.near.iter_mut().enumerate() {
            add(ratio, &|sums| sums.near_ratio(k));
        }
    }

    fn merge(&mut self, other: &Self) {
        self.sums.merge(&other.sums);
        for (mine, theirs) in self.cv.iter_mut().zip(&other.cv) {
            mine.merge(theirs);
        }
        for (mine, theirs) in self.near.iter_mut().zip(&other.near) {
            mine.merge(theirs);
        }
    }
}
