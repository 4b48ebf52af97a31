//! Sums of an evaluation that the report does not have: more truncations, frame by frame and pair by pair.

use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

use dmp::{Residuals, ScoredReturns, Sink, SurfaceGroup};

use super::clouds::Clouds;
use super::consistency::Sightings;
use super::result::{Both, common_cv};

/// Truncations of `R_cv`, metres; the first is that of the guard alone.
pub(super) const CV_M: [f64; 5] = [30.0, 10.0, 2.0, 0.5, 0.2];
/// Truncations of `R_near`, metres.
pub(super) const NEAR_M: [f64; 3] = [5.0, 2.0, 0.5];
/// All scores that pairs are judged by: those, and the first hits without a truncation.
const SCORES: usize = CV_M.len() + NEAR_M.len() + 1;

/// The scores that pairs are judged by: name, truncation in metres.
pub(super) fn pair_scores() -> impl Iterator<Item = (String, f64)> {
    let cv = CV_M.map(|t| (common_cv(t), t));
    let near = NEAR_M.map(|t| (format!("R_near({t})"), t));
    cv.into_iter().chain(near).chain([("DMP mean".to_owned(), 30.0)])
}

/// A sum of squared residuals over so many returns.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sum {
    pub(super) sum_m2: f64,
    pub(super) returns: f64,
}

/// A value for each of [`pair_scores`].
pub(super) type OfScores<T> = [T; SCORES];

/// All runs and pairs in one frame.
#[derive(Debug, Clone, Default)]
pub(super) struct Frame {
    pub(super) returns: f64,
    pub(super) runs: Vec<OfScores<Sum>>,
    /// In the order of [`pairs`], over the returns that both predict.
    pub(super) pairs: Vec<OfScores<Both>>,
}

/// Every two of `runs` runs, the lower first.
pub(super) fn pairs(runs: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..runs).flat_map(move |a| (a + 1..runs).map(move |b| (a, b)))
}

/// For every pair its sums by groups of surface.
type Surfaces = Vec<BTreeMap<SurfaceGroup, OfScores<Both>>>;

/// Takes the returns of an evaluation. The first run is the truth.
pub(super) struct Observer {
    runs: usize,
    frames: Mutex<Vec<Option<Box<Frame>>>>,
    /// In as many parts as threads were here at once.
    surfaces: Mutex<Vec<Surfaces>>,
    sightings: Mutex<Sightings>,
    clouds: Clouds,
}

/// What an evaluation left.
pub(super) struct Observed {
    /// In order of the log, without those that were not scored.
    pub(super) frames: Vec<Frame>,
    /// Every pair by groups of surface.
    pub(super) surfaces: Vec<Vec<OfScores<Both>>>,
    pub(super) sightings: Sightings,
    /// The points of each run.
    pub(super) clouds: Vec<Vec<[f64; 3]>>,
}

impl Observer {
    /// Of an evaluation of so many runs of a log of so many frames.
    pub(super) fn new(frames: usize, runs: usize) -> Self {
        Self {
            runs,
            frames: Mutex::new(vec![None; frames]),
            surfaces: Mutex::default(),
            sightings: Mutex::new(Sightings::new(runs)),
            clouds: Clouds::default(),
        }
    }

    pub(super) fn finish(self) -> Observed {
        let mut surfaces: Surfaces = vec![BTreeMap::new(); pairs(self.runs).count()];
        for part in self.surfaces.into_inner().unwrap_or_else(PoisonError::into_inner) {
            for (all, part) in surfaces.iter_mut().zip(part) {
                for (group, sums) in part {
                    let all = all.entry(group).or_default();
                    all.iter_mut().zip(&sums).for_each(|(all, sum)| all.merge(sum));
                }
            }
        }
        let frames = self.frames.into_inner().unwrap_or_else(PoisonError::into_inner);
        Observed {
            frames: frames.into_iter().flatten().map(|frame| *frame).collect(),
            surfaces: surfaces.into_iter().map(|of_pair| of_pair.into_values().collect()).collect(),
            sightings: self.sightings.into_inner().unwrap_or_else(PoisonError::into_inner),
            clouds: self.clouds.finish(),
        }
    }
}

impl Sink for Observer {
    fn returns_scored(&self, scored: &ScoredReturns<'_>) {
        let pair_count = pairs(self.runs).count();
        let lock_frames = || self.frames.lock().unwrap_or_else(PoisonError::into_inner);
        let lock_surfaces = || self.surfaces.lock().unwrap_or_else(PoisonError::into_inner);
        let mut frame = lock_frames()[scored.frame].take().unwrap_or_else(|| {
            let runs = vec![OfScores::default(); self.runs];
            Box::new(Frame { returns: 0.0, runs, pairs: vec![OfScores::default(); pair_count] })
        });
        let mut surfaces = lock_surfaces().pop().unwrap_or_else(|| vec![BTreeMap::new(); pair_count]);
        let mut squares = vec![OfScores::default(); self.runs];
        for index in 0..scored.offsets_ns.len() {
            frame.returns += 1.0;
            for ((run, squares), sums) in scored.runs.iter().zip(&mut squares).zip(&mut frame.runs) {
                let posed = run.as_ref().filter(|run| run.is_posed[index]);
                *squares = posed.map_or([None; SCORES], |run| squares_of(&run.residuals[index]));
                for (sum, square_m2) in sums.iter_mut().zip(squares.iter()) {
                    sum.sum_m2 += square_m2.unwrap_or(0.0);
                    sum.returns += f64::from(u8::from(square_m2.is_some()));
                }
            }
            for (((a, b), sums), surfaces) in pairs(self.runs).zip(&mut frame.pairs).zip(&mut surfaces) {
                let of_run = |run: usize| scored.runs[run].map(|run| run.residuals[index].surfaces[0]);
                let surface = |run: usize| of_run(run).unwrap_or_default();
                let off_m2 = |run: usize| squares[run][0].unwrap_or(0.0);
                let group = match off_m2(a).total_cmp(&off_m2(b)) {
                    Ordering::Greater => surface(a),
                    Ordering::Less => surface(b),
                    Ordering::Equal => surface(a).min(surface(b)),
                };
                let of_group = surfaces.entry(group).or_default();
                for (k, (a, b)) in squares[a].iter().zip(&squares[b]).enumerate() {
                    if let (Some(a_m2), Some(b_m2)) = (a, b) {
                        sums[k].add(*a_m2, *b_m2);
                        of_group[k].add(*a_m2, *b_m2);
                    }
                }
            }
        }
        lock_surfaces().push(surfaces);
        lock_frames()[scored.frame] = Some(frame);
        self.sightings.lock().unwrap_or_else(PoisonError::into_inner).merge(Sightings::of(scored));
        self.clouds.returns_scored(scored);
    }
}

/// What one return gives for one run, for each of [`pair_scores`].
fn squares_of(residuals: &Residuals) -> OfScores<Option<f64>> {
    let cut = |residual_m: f64, t: f64| (residual_m * residual_m).min(t * t);
    let near = |t: f64| residuals.first_m.map(|_| residuals.nearest_m.map_or(t * t, |r| cut(r, t)));
    let mut squares = [None; SCORES];
    let values = CV_M
        .into_iter()
        .map(|t| residuals.independent_m.map(|r| cut(r, t)))
        .chain(NEAR_M.into_iter().map(near))
        .chain([residuals.first_m.map(|r| r * r)]);
    squares.iter_mut().zip(values).for_each(|(square, value)| *square = value);
    squares
}
