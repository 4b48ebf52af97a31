use crate::basis::Basis;
use crate::error::ReduceError;
use crate::fixed::FixedSum;
use crate::frame::{FrameSums, pairs_of};
use crate::order::{Ranked, order_runs};
use crate::pair::PairTotals;
use crate::price::MissPrice;
use crate::ratio::{Asked, Estimate, Frames, Ratio, Total};
use crate::run::RunSums;
use crate::scales::{CV, NEAR, Scales, WIDEST};
use crate::student::Confidence;
use crate::verdict::{Comparison, Verdict, compare};

/// Most returns of one frame, and of all frames, for which no sum can overflow.
const FRAME_RETURNS: u64 = 1 << 32;
const ALL_RETURNS: u64 = 1 << 44;

/// What a [`Reducer`] is told beforehand: how many frames there are, and the runs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Layout {
    frames: Frames,
    bases: Vec<Basis>,
    miss_price: MissPrice,
    scales: Scales,
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

/// Takes the frames of a log, in any order and split over any number of reducers, and answers for the
/// whole. Its size depends on the number of runs alone, and its sums are integers: whichever way the
/// frames came in, the answers have the same bits.
///
/// Every frame is to be added at most once, a frame without returns too; what is added twice counts
/// twice. Where not all were added, they are taken for a sample that is spread evenly over the log, and the
/// intervals are those of the sampling.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reducer {
    layout: Layout,
    frames_added: u64,
    runs: Vec<RunTotals>,
    pairs: Vec<PairTotals>,
}

/// What a reducer has seen, without its layout: to be put down and taken up again by another process.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Seen {
    frames: u64,
    runs: Vec<RunTotals>,
    pairs: Vec<PairTotals>,
}

/// What is kept of one run.
#[derive(Debug, Clone, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
struct RunTotals {
    sums: RunSums,
    cv: [Ratio; CV - WIDEST],
    near: [Ratio; NEAR],
}

/// The scores of one run over all frames added.
#[derive(Debug, Clone, PartialEq)]
pub struct RunScores {
    /// Its sums, from which all scores come.
    pub sums: RunSums,
    /// As [`RunSums::r_cv_m2`], with intervals: (scale in metres, score).
    pub r_cv_m2: [(f64, Option<Estimate>); CV - WIDEST],
    /// As [`RunSums::r_near_m2`], with intervals: (scale in metres, score).
    pub r_near_m2: [(f64, Option<Estimate>); NEAR],
}

impl Reducer {
    /// A reducer that has seen no frame.
    pub fn new(layout: Layout) -> Self {
        let bases = &layout.bases;
        let pairs = pairs_of(bases.len()).map(|(a, b)| PairTotals::new(bases[a].of_pair(bases[b])));
        Self {
            frames_added: 0,
            runs: vec![RunTotals::default(); bases.len()],
            pairs: pairs.collect(),
            layout,
        }
    }

    /// What it has seen so far.
    pub fn seen(&self) -> Seen {
        Seen { frames: self.frames_added, runs: self.runs.clone(), pairs: self.pairs.clone() }
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
        if other_runs || seen.runs.iter().any(other_scales) {
            return Err(ReduceError::OtherRuns);
        }
        let resumed =
            Self { frames_added: 0, runs: seen.runs, pairs: seen.pairs, layout: empty.layout.clone() };
        empty.check_room(seen.frames, resumed.returns())?;
        Ok(Self { frames_added: seen.frames, ..resumed })
    }

    /// Adds the frame that is the `ordinal`-th of all.
    ///
    /// # Errors
    /// When the layout has no such frame, or other runs; when more frames come than it has; when the
    /// returns are too many. Nothing is added then.
    pub fn add_frame(&mut self, ordinal: u64, frame: &FrameSums) -> Result<(), ReduceError> {
        let frames = self.layout.frames;
        if ordinal >= frames.0 {
            return Err(ReduceError::NoSuchFrame { ordinal, frames: frames.0 });
        }
        if frame.bases() != self.layout.bases || frame.scales() != self.layout.scales {
            return Err(ReduceError::OtherRuns);
        }
        let returns = frame.runs().first().map_or(0, RunSums::returns);
        self.check_room(1, returns)?;
        if returns > FRAME_RETURNS {
            return Err(ReduceError::TooManyReturns);
        }
        self.frames_added += 1;
        for (totals, run) in self.runs.iter_mut().zip(frame.runs()) {
            totals.add_frame(ordinal, run, &self.layout);
        }
        for (totals, pair) in self.pairs.iter_mut().zip(frame.pair_sums()) {
            totals.add_frame(ordinal, &pair, frames);
        }
        Ok(())
    }

    /// Adds what another reducer of the same layout has seen.
    ///
    /// # Errors
    /// When the layouts differ, or the two together hold more frames or returns than one may. Nothing
    /// is added then.
    pub fn merge(&mut self, other: &Self) -> Result<(), ReduceError> {
        if self.layout != other.layout {
            return Err(ReduceError::OtherLayout);
        }
        self.check_room(other.frames_added, other.returns())?;
        self.frames_added += other.frames_added;
        for (mine, theirs) in self.runs.iter_mut().zip(&other.runs) {
            mine.merge(theirs);
        }
        for (mine, theirs) in self.pairs.iter_mut().zip(&other.pairs) {
            mine.merge(theirs);
        }
        Ok(())
    }

    fn check_room(&self, frames: u64, returns: u64) -> Result<(), ReduceError> {
        let all = self.layout.frames.0;
        if frames > all - self.frames_added {
            return Err(ReduceError::FrameTwice { frames: all });
        }
        if returns > ALL_RETURNS - self.returns() {
            return Err(ReduceError::TooManyReturns);
        }
        Ok(())
    }

    fn returns(&self) -> u64 {
        self.runs.first().map_or(0, |run| run.sums.returns())
    }

    /// What it was told beforehand.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Frames seen so far; the answers are for the whole when it is [`Layout::frames`].
    pub fn frames_added(&self) -> u64 {
        self.frames_added
    }

    /// The sums and scores of the `run`-th run.
    ///
    /// # Panics
    /// Where there is no such run.
    pub fn scores(&self, run: usize) -> RunScores {
        let totals = &self.runs[run];
        let asked = self.asked(Confidence::P99);
        let scales = self.layout.scales;
        RunScores {
            sums: totals.sums,
            r_cv_m2: std::array::from_fn(|k| (scales.cv_m()[WIDEST + k], totals.cv[k].estimate(asked))),
            r_near_m2: std::array::from_fn(|k| (scales.near_m()[k], totals.near[k].estimate(asked))),
        }
    }

    fn asked(&self, confidence: Confidence) -> Asked {
        Asked { scored: self.frames_added, frames: self.layout.frames, confidence }
    }

    /// Compares run `a` with run `b`, a < b, by intervals at `confidence`.
    ///
    /// # Panics
    /// Where there is no such pair.
    pub fn compare(&self, a: usize, b: usize, confidence: Confidence) -> Comparison {
        let runs = self.runs.len();
        assert!(a < b && b < runs, "no pair ({a}, {b}) of {runs} runs");
        // Pairs stand row by row; before row `a` there are rows of runs − 1, runs − 2, … pairs.
        let index = a * (2 * runs - a - 1) / 2 + (b - a - 1);
        let pair = &self.pairs[index];
        let predicted = [a, b].map(|run| match pair.basis {
            Basis::CrossValidated => self.runs[run].sums.with_independent(),
            Basis::Near => self.runs[run].sums.with_first(),
        });
        compare([a, b], predicted, pair, self.layout.scales, self.asked(confidence))
    }

    /// All pairs compared, in the order (0, 1), (0, 2), …, (1, 2), …
    pub fn comparisons(&self, confidence: Confidence) -> Vec<Comparison> {
        pairs_of(self.runs.len()).map(|(a, b)| self.compare(a, b, confidence)).collect()
    }

    /// The runs from best to worst: along the decided verdicts of `comparisons`, free choices by
    /// ascending `R_cv` at its widest scale, or so by `R_near` where any of the maps was given, as then it is the one score
    /// that all runs have. See [`order_runs`].
    pub fn order(&self, comparisons: &[Comparison]) -> Vec<Ranked> {
        let near = self.layout.bases.contains(&Basis::Near);
        let price = self.layout.miss_price;
        let score =
            |run: &RunTotals| if near { run.sums.r_near_m2()[0].1 } else { run.sums.r_cv_widest_m2(price) };
        let scores: Vec<_> = self.runs.iter().map(score).collect();
        let decided: Vec<_> = comparisons
            .iter()
            .filter_map(|pair| match pair.verdict {
                Verdict::Better { which, .. } => Some((which, pair.a + pair.b - which)),
                _ => None,
            })
            .collect();
        order_runs(&scores, &decided)
    }
}

impl RunTotals {
    fn add_frame(&mut self, ordinal: u64, frame: &RunSums, layout: &Layout) {
        let (frames, miss_price) = (layout.frames, layout.miss_price);
        let total = |(sum, returns): (FixedSum, u64)| Total { sum: sum.units(), returns };
        self.sums.merge(frame);
        for (k, ratio) in self.cv.iter_mut().enumerate() {
            ratio.add_frame(ordinal, total(frame.cv_ratio(WIDEST + k, miss_price)), frames);
        }
        for (k, ratio) in self.near.iter_mut().enumerate() {
            ratio.add_frame(ordinal, total(frame.near_ratio(k)), frames);
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
