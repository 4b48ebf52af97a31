//! A run mended by what it sees itself where it comes back.
//!
//! Visits to the same places are registered onto each other, as `dmp drift` does; the relative poses that this gives become edges
//! between keyframes of the run. Those that agree with each other and do not make the map worse are kept, the graph is optimised, and
//! all poses of the run are taken along. What comes out is measured again, as more visits are found where it is nearer.

mod acceptance;
mod chain;
mod consistent;
mod given;
#[cfg(test)]
mod tests;

use std::collections::BTreeSet;

use dmp::{Config, DriftPairs, DriftReach, PosedLog, Progress, Run, RunDrift, measure_drift};
use dmp_log::ScanLog;
use dmp_sensor::{PoseEdge, PoseGraph, Trajectory};

use crate::rank::{Compared, Ranker, Scorer, in_threads};
use crate::{LoopError, LoopMap, MapOptions, OptimiseOptions};
use acceptance::{accepted, rows};
use chain::Chain;
pub use chain::StepError;
use consistent::{DIRECTIONS, consistent, misfit};
pub use given::mend_by;

/// Poses that move by less than this from round to round are there, metres of a drive.
const SETTLED_M: f64 = 0.005;

/// How a run is mended.
#[derive(Debug, Clone, PartialEq)]
pub struct RepairOptions {
    /// Pairs of visits that are looked at.
    pub pairs: DriftPairs,
    /// How often visits are registered, at most.
    pub most_rounds: usize,
    /// The usual error of the run's steps; its factor for this run is estimated. Only their ratio matters where the run is off
    /// by much.
    pub step_error: StepError,
    /// How maps are put together and scored.
    pub map: MapOptions,
    /// How graphs are optimised.
    pub optimise: OptimiseOptions,
}

impl Default for RepairOptions {
    fn default() -> Self {
        Self {
            pairs: DriftPairs::All,
            most_rounds: 3,
            step_error: StepError::default(),
            map: MapOptions { rays_per_keyframe: 512, moved_m: None },
            optimise: OptimiseOptions::default(),
        }
    }
}

/// What became of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Outcome {
    /// It was mended.
    Repaired,
    /// It comes back to no place.
    NoRevisit,
    /// No pair of visits has an answer.
    NothingMeasured,
    /// Its revisits agree within the measurement error.
    NothingToRepair,
    /// No constraint was accepted: they contradict each other, or the map may become worse with any of them.
    NothingAccepted,
}

/// What was done at one time that visits were registered.
#[derive(Debug, Clone, PartialEq)]
pub struct Round {
    /// Pairs of visits that there were, and how many of them were looked at.
    pub pairs_found: usize,
    /// See [`Self::pairs_found`].
    pub pairs_measured: usize,
    /// Pairs with an answer: constraints.
    pub constraints: usize,
    /// Constraints that agree with each other.
    pub consistent: usize,
    /// Constraints in the graph.
    pub accepted: usize,
    /// Error of the run's steps, estimated from the constraints.
    pub step_error: StepError,
    /// How far the keyframe that moved most did so, against the run as it was given, metres.
    pub largest_move_m: f64,
    /// `R_near(2 m)` of the map of the patches with it, square metres.
    pub r_near_m2: Option<f64>,
}

/// A run, mended or not.
#[derive(Debug, Clone, PartialEq)]
pub struct Repair {
    /// What became of it.
    pub outcome: Outcome,
    /// The times that visits were registered; the last may have brought nothing.
    pub rounds: Vec<Round>,
    /// `R_near(2 m)` of the map of the patches as the run was given, square metres; `None` where it was not needed.
    pub r_near_before_m2: Option<f64>,
    /// The run with its poses moved; `None` where it was not mended.
    pub trajectory: Option<Trajectory>,
    /// Its keyframes with their edges, optimised: vertices are called by the numbers of their scans.
    pub graph: Option<PoseGraph>,
}

/// Mends a run. It is the same to the bit for every number of threads.
///
/// # Errors
/// When log and run do not belong together, the log cannot be read, or an option makes no sense.
pub fn repair(
    log: &dyn ScanLog,
    run: &Run,
    config: &Config,
    options: &RepairOptions,
    progress: &dyn Progress,
) -> Result<Repair, LoopError> {
    options.map.check()?;
    let unchanged = Repair {
        outcome: Outcome::NoRevisit,
        rounds: Vec::new(),
        r_near_before_m2: None,
        trajectory: None,
        graph: None,
    };
    let posed = PosedLog::new(log, run, config, progress)?;
    let Some(chain) = Chain::new(&posed) else { return Ok(unchanged) };
    let mut mending =
        Mending { log, run, config, options, progress, posed: &posed, chain, map: None, result: unchanged };
    for _ in 0..options.most_rounds {
        if !mending.round()? {
            break;
        }
    }
    Ok(mending.result)
}

/// A run while it is repaired.
struct Mending<'a> {
    log: &'a dyn ScanLog,
    run: &'a Run,
    config: &'a Config,
    options: &'a RepairOptions,
    progress: &'a dyn Progress,
    posed: &'a PosedLog<'a>,
    chain: Chain,
    /// Read when it is needed first.
    map: Option<LoopMap>,
    result: Repair,
}

/// The graph of a round, and its map beside that of the run and of the round before.
struct Found {
    graph: PoseGraph,
    to_run: Compared,
    to_before: Option<Compared>,
}

impl Mending<'_> {
    /// Registers visits once and mends the run by them; whether to go on.
    fn round(&mut self) -> Result<bool, LoopError> {
        let is_first = self.result.rounds.is_empty();
        let (mut report, mut edges) = self.constraints(DriftReach::Near)?;
        // A run that got lost has no visit near enough.
        let is_far = is_first && edges.is_empty();
        if is_far {
            (report, edges) = self.constraints(DriftReach::Far)?;
        }
        let mut round = Round {
            pairs_found: report.pairs_found,
            pairs_measured: report.pairs_measured,
            constraints: edges.len(),
            consistent: 0,
            accepted: 0,
            step_error: self.options.step_error,
            largest_move_m: 0.0,
            r_near_m2: None,
        };
        let optimise = &self.options.optimise;
        let without = match edges.len() {
            0 if report.pairs_measured == 0 => Some(Outcome::NoRevisit),
            0 => Some(Outcome::NothingMeasured),
            some if is_first && misfit(&self.chain, &edges, optimise)? <= DIRECTIONS * some as f64 => {
                Some(Outcome::NothingToRepair)
            }
            _ => None,
        };
        if is_first {
            self.result.outcome = without.unwrap_or(Outcome::NothingAccepted);
        }
        if without.is_some() {
            self.result.rounds.push(round);
            return Ok(false);
        }
        let found = consistent(&self.chain, &edges, self.options.step_error, optimise)?;
        (round.consistent, round.step_error) = (found.kept.len(), found.error);
        let kept = found.kept.iter().map(|&k| edges[k].clone()).collect();
        let rows = rows(&self.chain, kept, report.travel_m / report.segments.max(1) as f64);
        let alone = self.chain.graph(found.error)?;
        let Found { graph, to_run, to_before } = self.accepted(&alone, rows)?;
        round.accepted = graph.edges().len() - alone.edges().len();
        round.r_near_m2 = to_run.after_m2;
        round.largest_move_m = largest_move_m(&alone, &graph);
        let result = &mut self.result;
        result.r_near_before_m2 = result.r_near_before_m2.or(to_run.before_m2);
        // What does not make the map better is left: it may be noise of the measurement.
        let is_better = to_run.is_better() && to_before.is_none_or(|to| to.is_better() || !to.may_be_worse);
        // Visits that are looked for further off more easily meet the wrong place: a map that takes one of some that agree and
        // refuses the others says so.
        let is_right_place = !is_far || 2 * round.accepted > round.consistent;
        let is_taken = round.accepted > 0 && is_right_place && is_better;
        result.rounds.push(round);
        if !is_taken {
            return Ok(false);
        }
        let settled_m = SETTLED_M * self.posed.settings().scales.lengths().metre_m;
        let has_settled =
            result.graph.as_ref().is_some_and(|before| largest_move_m(before, &graph) <= settled_m);
        result.outcome = Outcome::Repaired;
        result.trajectory = Some(self.chain.taken_along(&self.run.trajectory, graph.poses())?);
        result.graph = Some(graph);
        Ok(!has_settled)
    }

    /// What the visits of the run, as it is now, say.
    fn constraints(&self, reach: DriftReach) -> Result<(RunDrift, Vec<PoseEdge>), LoopError> {
        let now = self.result.trajectory.clone().unwrap_or_else(|| self.run.trajectory.clone());
        let now = [Run { trajectory: now, ..self.run.clone() }];
        let config = Config { drift: self.options.pairs, drift_reach: reach, ..self.config.clone() };
        let drift = measure_drift(self.log, &now, &config, self.progress)?.runs.swap_remove(0);
        let body_from_sensor = self.run.body_from_sensor.unwrap_or(self.config.body_from_sensor);
        let edges = of_keyframes(&self.chain, &drift.constraints(&body_from_sensor));
        Ok((drift, edges))
    }

    /// The graph with the rows that the map takes.
    fn accepted(&mut self, alone: &PoseGraph, rows: Vec<Vec<PoseEdge>>) -> Result<Found, LoopError> {
        let (optimise, progress) = (&self.options.optimise, self.progress);
        let map = match self.map.take() {
            Some(map) => map,
            None => {
                LoopMap::of_posed(self.posed, self.chain.of_scan(), &self.chain.poses(), self.options.map)?
            }
        };
        let map = &*self.map.insert(map);
        let before = self.result.graph.as_ref();
        in_threads(self.config.threads, || {
            let graph = accepted(alone.clone(), map, rows, optimise, progress)?;
            let against = |before: &PoseGraph| {
                let ranker = Ranker::new(before.clone(), optimise.clone(), Scorer::patches(map), progress)?;
                ranker.compared(graph.poses(), progress)
            };
            let (to_run, to_before) = (against(alone)?, before.map(against).transpose()?);
            Ok(Found { graph, to_run, to_before })
        })?
    }
}

/// Constraints between scans as constraints between keyframes, each two of these once.
fn of_keyframes(chain: &Chain, edges: &[PoseEdge]) -> Vec<PoseEdge> {
    let mut seen = BTreeSet::new();
    let of_keyframes = edges.iter().filter_map(|edge| chain.between_keyframes(edge));
    of_keyframes.filter(|edge| seen.insert((edge.from, edge.to))).collect()
}

fn largest_move_m(a: &PoseGraph, b: &PoseGraph) -> f64 {
    let moves = a.poses().iter().zip(b.poses());
    moves.map(|(a, b)| (a.translation.vector - b.translation.vector).norm()).fold(0.0, f64::max)
}
