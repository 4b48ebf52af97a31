//! Which candidates are accepted, one after the other.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use dmp::{Progress, Stage};
use dmp_sensor::{Isometry3, PoseEdge, PoseGraph};

use super::ranker::{Ranker, Ranking, Tried, TryFault};
use crate::map::MapScores;
use crate::{LoopError, optimise};

/// Growth of the sum of squares that 1 in 100 right loops exceeds, where no map is looked at: the quantile .99 of chi² with
/// six degrees of freedom.
const LARGEST_CHI2: f64 = 16.811_893_829_770_927;

/// A map may be this much worse, as a share of its root mean square, and still count as the same.
const TOLERATED: f64 = 0.1;

/// What became of a candidate.
#[derive(Debug)]
pub struct Decision {
    /// Its place among the candidates.
    pub index: usize,
    /// Whether it was accepted, and why not.
    pub verdict: Verdict,
    /// How many candidates had been accepted when that was decided.
    pub after: usize,
    /// What it made of the graph with those.
    pub tried: Option<Tried>,
}

/// Whether a candidate was accepted.
#[derive(Debug)]
pub enum Verdict {
    /// It is in the graph.
    Accepted,
    /// It may make the score worse by more than what counts as the same.
    Worse,
    /// With those accepted before it, it has no score.
    Failed(TryFault),
}

/// Which candidates were accepted.
#[derive(Debug)]
pub struct Acceptance {
    /// Of those that have a score on the graph without candidates, in the order of the decisions.
    pub decisions: Vec<Decision>,
    /// The graph with the accepted ones, optimised.
    pub graph: PoseGraph,
    /// `R_near(2 m)` of its map, square metres; `None` where no map is looked at.
    pub r_near_m2: Option<f64>,
    /// The sum of squares of its edges.
    pub chi2: f64,
}

/// A map beside the one before it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Compared {
    /// Whether it may be worse, by the interval of its change, by more than what counts as the same.
    pub(crate) may_be_worse: bool,
    /// `R_near(2 m)` of both, square metres.
    pub(crate) before_m2: Option<f64>,
    pub(crate) after_m2: Option<f64>,
}

impl Compared {
    /// Whether it is better by its value.
    pub(crate) fn is_better(&self) -> bool {
        self.before_m2.zip(self.after_m2).is_some_and(|(before_m2, after_m2)| after_m2 < before_m2)
    }
}

/// A candidate that waits.
#[derive(Debug)]
struct Waiting {
    /// What it made of the graph when it was tried last, and how many had been accepted then.
    tried: Tried,
    after: usize,
    /// How much worse the score was with it than without: as the graph gets better, there is less to be gained, so that
    /// what was found before is hardly ever too bad.
    change: f64,
}

/// The best comes first: the lowest change, then the first candidate.
impl Ord for Waiting {
    fn cmp(&self, other: &Self) -> Ordering {
        other.change.total_cmp(&self.change).then(other.tried.index.cmp(&self.tried.index))
    }
}

impl PartialOrd for Waiting {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Waiting {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Waiting {}

impl Ranker<'_> {
    /// Adds candidates from best to worst, and keeps each that by the 99 % interval of the change makes the score worse by no
    /// more than what counts as the same (`TOLERATED` of the best score so far, which nothing that is kept is further away
    /// from, so that many small steps do not add up); where no map is looked at, each whose sum of squares grows by no more than
    /// 99 of 100 right loops would.
    ///
    /// Whenever the graph has grown, what comes next is tried again on it, and goes back among the others where it is no
    /// longer the best: a lazy greedy search, which tries few candidates more than twice. Accepted loops have no robust
    /// kernel, as when they were tried.
    ///
    /// # Errors
    /// As [`Self::rank`]; when changes have no intervals; when the ranking is of other candidates; and when the graph with a
    /// candidate cannot be scored.
    pub fn accept<E: AsRef<[PoseEdge]>>(
        mut self,
        candidates: &[E],
        ranking: &Ranking,
        progress: &dyn Progress,
    ) -> Result<Acceptance, LoopError> {
        if !self.scorer.has_intervals() && self.without.map.is_some() {
            return Err(LoopError::NoIntervals);
        }
        if let Some(tried) = ranking.ranked.iter().find(|tried| tried.index >= candidates.len()) {
            return Err(LoopError::OtherCandidates { index: tried.index, candidates: candidates.len() });
        }
        progress.begin(Stage::Candidates, candidates.len() as u64);
        let mut waiting: BinaryHeap<Waiting> =
            ranking.ranked.iter().map(|tried| self.waiting(tried.clone(), 0)).collect();
        let mut decisions = Vec::new();
        progress.advance(ranking.failed.len() as u64);
        let mut accepted = 0;
        let mut best = self.without.score();
        while let Some(Waiting { tried, after, .. }) = waiting.pop() {
            let index = tried.index;
            let tried = if after == accepted {
                tried
            } else {
                match self.try_one(index, candidates[index].as_ref(), true, progress)? {
                    Ok(tried) => tried,
                    Err(fault) => {
                        decisions.push(Decision {
                            index,
                            verdict: Verdict::Failed(fault),
                            after: accepted,
                            tried: None,
                        });
                        progress.advance(1);
                        continue;
                    }
                }
            };
            let again = self.waiting(tried, accepted);
            if waiting.peek().is_some_and(|next| *next > again) {
                waiting.push(again);
                continue;
            }
            let tried = again.tried;
            let verdict = if is_worse(&tried, best) { Verdict::Worse } else { Verdict::Accepted };
            let is_accepted = matches!(verdict, Verdict::Accepted);
            if is_accepted {
                self.add(candidates[index].as_ref(), progress)?;
                best = best.min(self.without.score());
            }
            decisions.push(Decision { index, verdict, after: accepted, tried: Some(tried) });
            accepted += usize::from(is_accepted);
            progress.advance(1);
        }
        let r_near_m2 = self.without.map.as_ref().and_then(MapScores::ranked_m2);
        let graph = self.accepted.iter().try_fold(self.graph, |graph, edge| graph.with_edge(edge.clone()))?;
        Ok(Acceptance { decisions, r_near_m2, chi2: self.without.chi2, graph })
    }

    /// The map with its keyframes at `world_from_body`, beside this graph's.
    pub(crate) fn compared(
        &self,
        world_from_body: &[Isometry3<f64>],
        progress: &dyn Progress,
    ) -> Result<Compared, LoopError> {
        let there = self.before.score(world_from_body, true, progress)?;
        Ok(Compared {
            may_be_worse: there.as_ref().is_none_or(|map| is_map_worse(map, self.without.score())),
            before_m2: self.without.map.as_ref().and_then(MapScores::ranked_m2),
            after_m2: there.as_ref().and_then(MapScores::ranked_m2),
        })
    }

    fn waiting(&self, tried: Tried, after: usize) -> Waiting {
        let paired = tried.map.as_ref().and_then(|map| map.change).map(|change| change.value_m2);
        let change = paired.unwrap_or_else(|| tried.score() - self.without.score());
        Waiting { tried, after, change }
    }

    /// Makes a candidate one of the graph's edges: the poses are those that it was tried with.
    fn add(&mut self, candidate: &[PoseEdge], progress: &dyn Progress) -> Result<(), LoopError> {
        self.accepted.extend_from_slice(candidate);
        let found = optimise(&self.graph, &self.accepted, &self.options).map_err(LoopError::Graph)?;
        self.without.chi2 = found.chi2_after;
        (self.before, self.without.map) = self.scorer.begin_at(&found.world_from_body, progress)?;
        self.graph = self.graph.with_poses(found.world_from_body)?;
        Ok(())
    }
}

/// Whether the score may become worse than what counts as the same, `best_m2` being the best there was; an unknown
/// change may.
fn is_worse(tried: &Tried, best_m2: f64) -> bool {
    tried.map.as_ref().map_or(tried.chi2_change > LARGEST_CHI2, |map| is_map_worse(map, best_m2))
}

fn is_map_worse(map: &MapScores, best_m2: f64) -> bool {
    let best_m = best_m2.sqrt();
    let most_m = (1.0 + TOLERATED) * best_m;
    let most_m2 = most_m * most_m - best_m2;
    let interval = map.change.and_then(|change| change.interval);
    interval.is_none_or(|interval| {
        interval.high_m2 > most_m2 || map.ranked_m2().is_none_or(|m2| m2 - best_m2 > most_m2)
    })
}
