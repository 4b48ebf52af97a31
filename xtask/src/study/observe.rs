//! Follows an evaluation and sums up what the report does not have: other truncations, pair by pair.

use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::sync::Mutex;

use dmp::{Residuals, ScoredReturns, Sink, SurfaceGroup};

use super::consistency::Sightings;

/// Truncations at which R_cv is looked at, metres.
pub(super) const CV_M: [f64; 7] = [30.0, 10.0, 5.0, 2.0, 1.0, 0.5, 0.2];
/// Truncations at which R_near is looked at, metres.
pub(super) const NEAR_M: [f64; 4] = [5.0, 2.0, 1.0, 0.5];

/// A sum of squared residuals, or of their differences, over so many returns.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sum {
    pub(super) sum_m2: f64,
    pub(super) returns: f64,
}

impl Sum {
    fn add(&mut self, value_m2: f64) {
        self.sum_m2 += value_m2;
        self.returns += 1.0;
    }
}

/// One run in one frame.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct RunFrame {
    pub(super) returns: f64,
    /// Over returns with zc.
    pub(super) cv: [Sum; CV_M.len()],
    /// Over returns with z1.
    pub(super) near: [Sum; NEAR_M.len()],
}

/// Two runs in one frame, over the returns that both predict: differences first minus second.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct PairFrame {
    pub(super) cv: [Both; CV_M.len()],
    pub(super) near: [Both; NEAR_M.len()],
    pub(super) first: Both,
}

/// Two runs over so many returns.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Both {
    pub(super) difference_m2: f64,
    pub(super) level_m2: f64,
    pub(super) returns: f64,
}

impl Both {
    pub(super) fn merge(&mut self, other: &Self) {
        self.difference_m2 += other.difference_m2;
        self.level_m2 += other.level_m2;
        self.returns += other.returns;
    }

    fn add(&mut self, a_m2: f64, b_m2: f64) {
        self.difference_m2 += a_m2 - b_m2;
        self.level_m2 += a_m2 + b_m2;
        self.returns += 1.0;
    }
}

impl PairFrame {
    /// The sums of a score that pairs are judged by, by its name.
    pub(super) fn of(&self, score: Score) -> Both {
        match score {
            Score::Cv(k) => self.cv[k],
            Score::Near(k) => self.near[k],
            Score::First => self.first,
        }
    }
}

/// A score that pairs are judged by: which of its truncations.
#[derive(Debug, Clone, Copy)]
pub(super) enum Score {
    Cv(usize),
    Near(usize),
    First,
}

/// For every pair its sums by groups of surface.
type Surfaces = Vec<BTreeMap<SurfaceGroup, PairFrame>>;

/// All runs and pairs in one frame.
#[derive(Debug, Clone, Default)]
pub(super) struct Frame {
    pub(super) runs: Vec<RunFrame>,
    /// In the order of [`pairs`].
    pub(super) pairs: Vec<PairFrame>,
}

/// Every two of `runs` runs, the lower first.
pub(super) fn pairs(runs: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..runs).flat_map(move |a| (a + 1..runs).map(move |b| (a, b)))
}

/// Sums by frame, and sightings of the same places. The first run is the truth.
#[derive(Debug)]
pub(super) struct Observer {
    frames: Mutex<Vec<Option<Box<Frame>>>>,
    sightings: Option<Mutex<Sightings>>,
    /// Sums by groups of surface, in as many parts as threads came by at once.
    surfaces: Mutex<Vec<Surfaces>>,
    runs: usize,
}

/// What one return gives for one run.
#[derive(Debug, Clone, Copy, Default)]
struct Squares {
    surface: SurfaceGroup,
    cv: Option<[f64; CV_M.len()]>,
    near: Option<[f64; NEAR_M.len()]>,
    first: Option<f64>,
}

impl Squares {
    fn of(residuals: &Residuals) -> Self {
        Self {
            surface: residuals.surfaces[0],
            cv: residuals.independent_m.map(|r| CV_M.map(|t| (r * r).min(t * t))),
            near: residuals
                .first_m
                .map(|_| NEAR_M.map(|t| residuals.nearest_m.map_or(t * t, |r| (r * r).min(t * t)))),
            first: residuals.first_m.map(|r| r * r),
        }
    }
}

impl Observer {
    /// Of an evaluation of so many runs of a log of so many frames; with `sightings`, places that are seen
    /// again are remembered.
    pub(super) fn new(frames: usize, runs: usize, sightings: bool) -> Self {
        let sightings = sightings.then(|| Mutex::new(Sightings::new(runs)));
        Self { frames: Mutex::new(vec![None; frames]), sightings, surfaces: Mutex::default(), runs }
    }

    /// Frames in order of the log, without those that were not scored; every pair by groups of surface; and the sightings.
    pub(super) fn finish(self) -> (Vec<Frame>, Vec<Vec<PairFrame>>, Option<Sightings>) {
        let mut surfaces: Surfaces = vec![BTreeMap::new(); pairs(self.runs).count()];
        for part in self.surfaces.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner) {
            for (all, part) in surfaces.iter_mut().zip(part) {
                part.into_iter().for_each(|(group, sums)| all.entry(group).or_default().merge(&sums));
            }
        }
        let surfaces = surfaces.into_iter().map(|of_pair| of_pair.into_values().collect()).collect();
        let frames = self.frames.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
        let sightings =
            self.sightings.map(|s| s.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner));
        (frames.into_iter().flatten().map(|frame| *frame).collect(), surfaces, sightings)
    }
}

impl Sink for Observer {
    fn returns_scored(&self, scored: &ScoredReturns<'_>) {
        let taken =
            self.frames.lock().unwrap_or_else(std::sync::PoisonError::into_inner)[scored.frame].take();
        let mut frame = taken.unwrap_or_else(|| {
            let pairs = vec![PairFrame::default(); pairs(self.runs).count()];
            Box::new(Frame { runs: vec![RunFrame::default(); self.runs], pairs })
        });
        let lock = || self.surfaces.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let mut surfaces = lock().pop().unwrap_or_else(|| vec![BTreeMap::new(); frame.pairs.len()]);
        let mut of_return = vec![Squares::default(); self.runs];
        for index in 0..scored.offsets_ns.len() {
            for (run, squares) in of_return.iter_mut().enumerate() {
                *squares = Squares::of(&scored.runs[run].residuals[index]);
                frame.runs[run].add(squares);
            }
            for (((a, b), pair), surfaces) in pairs(self.runs).zip(&mut frame.pairs).zip(&mut surfaces) {
                let (a, b) = (&of_return[a], &of_return[b]);
                pair.add(a, b);
                let off = |squares: &Squares| squares.cv.map_or(0.0, |cv| cv[0]);
                let surface = match off(a).total_cmp(&off(b)) {
                    Ordering::Greater => a.surface,
                    Ordering::Less => b.surface,
                    Ordering::Equal => a.surface.min(b.surface),
                };
                surfaces.entry(surface).or_default().add(a, b);
            }
        }
        lock().push(surfaces);
        self.frames.lock().unwrap_or_else(std::sync::PoisonError::into_inner)[scored.frame] = Some(frame);
        if let Some(sightings) = &self.sightings {
            let seen = Sightings::of(scored);
            sightings.lock().unwrap_or_else(std::sync::PoisonError::into_inner).merge(seen);
        }
    }
}

impl RunFrame {
    fn add(&mut self, squares: &Squares) {
        self.returns += 1.0;
        if let Some(cv) = squares.cv {
            self.cv.iter_mut().zip(cv).for_each(|(sum, square)| sum.add(square));
        }
        if let Some(near) = squares.near {
            self.near.iter_mut().zip(near).for_each(|(sum, square)| sum.add(square));
        }
    }
}

impl PairFrame {
    fn merge(&mut self, other: &Self) {
        fn all<const N: usize>(sums: &mut [Both; N], others: &[Both; N]) {
            sums.iter_mut().zip(others).for_each(|(sum, other)| sum.merge(other));
        }
        all(&mut self.cv, &other.cv);
        all(&mut self.near, &other.near);
        self.first.merge(&other.first);
    }

    fn add(&mut self, a: &Squares, b: &Squares) {
        fn all<const N: usize>(sums: &mut [Both; N], a: Option<[f64; N]>, b: Option<[f64; N]>) {
            if let (Some(a), Some(b)) = (a, b) {
                sums.iter_mut().zip(a.into_iter().zip(b)).for_each(|(sum, (a, b))| sum.add(a, b));
            }
        }
        all(&mut self.cv, a.cv, b.cv);
        all(&mut self.near, a.near, b.near);
        if let (Some(a), Some(b)) = (a.first, b.first) {
            self.first.add(a, b);
        }
    }
}
