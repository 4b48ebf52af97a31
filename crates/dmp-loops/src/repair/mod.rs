//! A run mended by what it sees itself where it comes back.
//!
//! Visits to the same places are registered onto each other, as `dmp drift` does; the relative poses that this gives become edges
//! between keyframes of the run. Those that agree with each other and do not make the map worse are kept, the graph is optimised, and
//! all poses of the run are taken along. What comes out is measured again, as more visits are found where it is nearer.

mod acceptance;
mod chain;
mod consistent;
mod given;

use std::collections::BTreeSet;

use dmp::{Config, PosedLog, Progress, Run, measure_drift};
use dmp_log::ScanLog;
use dmp_sensor::{PoseEdge, PoseGraph, Trajectory};

use crate::rank::{Ranker, Scorer, in_threads};
use crate::{LoopError, LoopMap, MapOptions, OptimiseOptions};
use acceptance::{accepted, rows};
use chain::Chain;
pub use chain::StepError;
use consistent::{consistent, misfit};
pub use given::mend_by;

/// Poses that move by less than this from round to round are there, metres of a drive.
const SETTLED_M: f64 = 0.005;

/// How a run is mended.
#[derive(Debug, Clone, PartialEq)]
pub struct RepairOptions {
    /// Pairs of visits that are looked at, at most.
    pub most_pairs: Option<usize>,
    /// How often visits are registered, at most.
    pub most_rounds: usize,
    /// What the run's steps usually err by; how many times that it is here is found out. Only their ratio matters where the run is off
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
            most_pairs: None,
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
    /// It comes back as well as the measurement can tell.
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
    /// What the run's steps err by, as the constraints tell.
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
    let mut told = Repair {
        outcome: Outcome::NoRevisit,
        rounds: Vec::new(),
        r_near_before_m2: None,
        trajectory: None,
        graph: None,
    };
    let posed = PosedLog::new(log, run, config, progress)?;
    let Some(chain) = Chain::new(&posed) else { return Ok(told) };
    let body_from_sensor = run.body_from_sensor.unwrap_or(config.body_from_sensor);
    let metre_m = posed.settings().scales.lengths().metre_m;
    let mut map = None;
    for round in 0..options.most_rounds {
        let now = Run {
            trajectory: told.trajectory.clone().unwrap_or_else(|| run.trajectory.clone()),
            ..run.clone()
        };
        let report = measure_drift(log, std::slice::from_ref(&now), config, options.most_pairs, progress)?;
        let edges = of_keyframes(&chain, &report.constraints(0, &body_from_sensor));
        let mut this = Round {
            pairs_found: report.pairs_found,
            pairs_measured: report.pairs_measured,
            constraints: edges.len(),
            consistent: 0,
            accepted: 0,
            step_error: options.step_error,
            largest_move_m: 0.0,
            r_near_m2: None,
        };
        if edges.is_empty() {
            if round == 0 && report.pairs_measured > 0 {
                told.outcome = Outcome::NothingMeasured;
            }
            told.rounds.push(this);
            break;
        }
        if round == 0 && misfit(&chain, &edges, &options.optimise)? <= 6.0 * edges.len() as f64 {
            told.outcome = Outcome::NothingToRepair;
            told.rounds.push(this);
            break;
        }
        if round == 0 {
            told.outcome = Outcome::NothingAccepted;
        }
        let found = consistent(&chain, &edges, options.step_error, &options.optimise)?;
        (this.consistent, this.step_error) = (found.kept.len(), found.error);
        if map.is_none() {
            map = Some(LoopMap::of_posed(&posed, chain.of_scan(), &chain.poses(), options.map)?);
        }
        let Some(map) = &map else { break };
        let kept = found.kept.iter().map(|&k| edges[k].clone()).collect();
        let rows = rows(&chain, kept, report.travel_m / report.segments.max(1) as f64);
        let alone = chain.graph(found.error)?;
        let steps = alone.edges().len();
        let work = || {
            let graph = accepted(alone.clone(), map, rows, &options.optimise, progress)?;
            let against = |before: &PoseGraph| {
                let scorer = Scorer::patches(map);
                let ranker = Ranker::new(before.clone(), options.optimise.clone(), scorer, progress)?;
                ranker.compared(graph.poses(), progress)
            };
            let to_run = against(&alone)?;
            let to_before = told.graph.as_ref().map(against).transpose()?;
            Ok::<_, LoopError>((graph, to_run, to_before))
        };
        let (graph, to_run, to_before) = in_threads(config.threads, work)??;
        this.accepted = graph.edges().len() - steps;
        this.r_near_m2 = to_run.after_m2;
        this.largest_move_m = largest_move_m(&alone, &graph);
        told.r_near_before_m2 = told.r_near_before_m2.or(to_run.before_m2);
        let has_settled =
            told.graph.as_ref().is_some_and(|before| largest_move_m(before, &graph) <= SETTLED_M * metre_m);
        // What does not make the map better is left: it may be noise of the measurement.
        let goes_on = to_before.is_none_or(|before| before.is_better() || !before.may_be_worse);
        let is_taken = this.accepted > 0 && to_run.is_better() && goes_on;
        told.rounds.push(this);
        if !is_taken {
            break;
        }
        told.outcome = Outcome::Repaired;
        told.trajectory = Some(chain.taken_along(&run.trajectory, graph.poses())?);
        told.graph = Some(graph);
        if has_settled {
            break;
        }
    }
    Ok(told)
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
