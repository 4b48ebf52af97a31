//! Levenberg and Marquardt's descent, step by step.

use super::cholesky::Model;
use super::error::OptimiseError;
use super::kernel::Kernel;
use super::problem::Problem;
use dmp_sensor::Isometry3;
use nalgebra::Vector6;

/// How a graph is optimised.
#[derive(Debug, Clone, PartialEq)]
pub struct OptimiseOptions {
    /// Steps that are tried at most.
    pub most_iterations: usize,
    /// The longest step of a pose, metres and radians, that is as good as none.
    pub tolerance: f64,
    /// A robust kernel for the loops of the graph itself: edges between vertices that do not follow each other in the
    /// order of the ids. Added edges have none: what they do is the question.
    pub loop_kernel: Option<Kernel>,
}

impl Default for OptimiseOptions {
    fn default() -> Self {
        Self { most_iterations: 100, tolerance: 1e-8, loop_kernel: None }
    }
}

/// How much of what the slope promises a step must bring (Armijo 1966).
const WORTH: f64 = 1e-4;
/// What the diagonal of Gauss and Newton's matrix is made larger by, of itself, where rounding left it not positive definite.
const DAMPING: [f64; 5] = [0.0, 1e-12, 1e-9, 1e-6, 1e-3];
/// Steps are shortened down to this share.
const LEAST_SHARE: f64 = 1e-10;

/// Where the descent ended.
#[derive(Debug)]
pub(super) struct Descent {
    pub(super) poses: Vec<Isometry3<f64>>,
    /// Steps that were tried.
    pub(super) iterations: usize,
    /// Whether that is a minimum.
    pub(super) converged: bool,
    /// Whether a step was made at all.
    pub(super) has_moved: bool,
}

/// Goes downhill by Newton's method; where its matrix has directions that go downhill both ways, by that of Gauss and
/// Newton, whose matrix has none. A step that is too long for what it brings is shortened.
///
/// A wrong loop bends a graph, and the stress of its edges then says more about the soft ways to move it than the slopes
/// do: without second derivatives the steps swing to and fro. With them, a handful of steps is enough.
pub(super) fn descend(
    problem: &mut Problem<'_>,
    poses: Vec<Isometry3<f64>>,
    options: &OptimiseOptions,
) -> Result<Descent, OptimiseError> {
    let mut cost = problem.cost(&poses);
    let mut now = Descent { poses, iterations: 0, converged: false, has_moved: false };
    while now.iterations < options.most_iterations {
        now.iterations += 1;
        problem.linearise(&now.poses);
        let newton = problem.step(Model::Newton);
        let is_valley = newton.is_some();
        let damped = || DAMPING.iter().find_map(|damping| problem.step(Model::GaussNewton(*damping)));
        let step = newton.or_else(damped).ok_or(OptimiseError::Undetermined)?;
        if step.iter().all(|step| step.amax() <= options.tolerance) {
            now.converged = is_valley;
            break;
        }
        let slope = problem.slope_along(&step);
        let Some((there, cost_there)) = search(problem, &now.poses, cost, &step, slope) else { break };
        now.poses = there;
        now.has_moved = true;
        if is_valley && -slope <= rounding(cost) {
            // Newton's next step would change less than rounding.
            now.converged = true;
            break;
        }
        cost = cost_there;
    }
    Ok(now)
}

/// The poses after a step, or after a part of it that is worth it, and their cost.
fn search(
    problem: &Problem<'_>,
    poses: &[Isometry3<f64>],
    cost: f64,
    step: &[Vector6<f64>],
    slope: f64,
) -> Option<(Vec<Isometry3<f64>>, f64)> {
    let mut share = 1.0;
    while share >= LEAST_SHARE {
        let there = problem.moved(poses, step, share);
        let cost_there = problem.cost(&there);
        if cost_there <= cost + WORTH * share * slope + rounding(cost) {
            return Some((there, cost_there));
        }
        // The lowest place of the parabola of what is known.
        let bend = (cost_there - cost - share * slope) / (share * share);
        let lowest = -slope / (2.0 * bend);
        share = if lowest.is_finite() { lowest.clamp(0.1 * share, 0.5 * share) } else { 0.1 * share };
    }
    None
}

/// Changes of a cost that mean nothing: its rounding, or, of one that is next to nothing, less than 10⁻⁹ standard deviations.
fn rounding(cost: f64) -> f64 {
    1e-13 * cost + 1e-18
}
