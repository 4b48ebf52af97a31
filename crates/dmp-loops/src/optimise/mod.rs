//! The poses that fit the edges of a graph best.

mod cholesky;
mod descent;
mod elimination;
mod error;
mod kernel;
mod problem;
mod residual;

pub use error::OptimiseError;
pub use kernel::Kernel;

pub use descent::OptimiseOptions;
use descent::{Descent, descend};
use dmp_sensor::{Isometry3, PoseEdge, PoseGraph, Vector3};
use problem::Problem;

/// What an optimisation found.
#[derive(Debug, Clone, PartialEq)]
pub struct Optimised {
    /// The poses `world_from_body`, one a vertex in the order of the ids.
    pub world_from_body: Vec<Isometry3<f64>>,
    /// The sum of squares of all edges, those added too, at the poses of the graph: residuals as g2o has them, weighted
    /// by their information, without kernels.
    pub chi2_before: f64,
    /// The same at the poses that were found.
    pub chi2_after: f64,
    /// The squares of the added edges at the poses that were found.
    pub extra_chi2: Vec<f64>,
    /// Steps that were tried.
    pub iterations: usize,
    /// Whether the poses are a minimum: the next step would be as good as none, and every other one goes uphill. Otherwise
    /// they are the best ones that were found.
    pub converged: bool,
}

/// Finds the poses where the sum of squares of the graph's edges and the extra ones is least, downhill from the graph's
/// poses. The graph's fixed vertices are held where they are; where it has none, the first.
///
/// Poses that are the best already, within the tolerance, come back to the same bits. One thread, and the same bits
/// everywhere; a graph of some hundred vertices takes milliseconds.
///
/// # Errors
/// When an option is no number above 0, an extra edge is none that the graph can have, the edges do not connect all
/// vertices, or the measurements are too large or too uneven for numbers. Not converging is no error:
/// see [`Optimised::converged`].
pub fn optimise(
    graph: &PoseGraph,
    extra: &[PoseEdge],
    options: &OptimiseOptions,
) -> Result<Optimised, OptimiseError> {
    check(graph, extra, options)?;
    let mut problem = Problem::new(graph, extra, options.loop_kernel);
    // World coordinates of thousands of kilometres would round the steps.
    let origin = graph.poses().first().map_or_else(Vector3::zeros, |pose| pose.translation.vector);
    let start: Vec<Isometry3<f64>> = graph.poses().iter().map(|pose| shifted(pose, -origin)).collect();
    let chi2_before = problem.chi2(&start);
    if !chi2_before.is_finite() {
        return Err(OptimiseError::NotFinite { chi2: chi2_before });
    }
    let Descent { poses, iterations, converged, has_moved } = descend(&mut problem, start, options)?;
    let chi2_after = problem.chi2(&poses);
    let extra_chi2 = problem.chi2_of_last(extra.len(), &poses);
    let back = |(vertex, pose): (usize, &Isometry3<f64>)| {
        if has_moved && !problem.is_held(vertex) { shifted(pose, origin) } else { graph.poses()[vertex] }
    };
    let world_from_body = poses.iter().enumerate().map(back).collect();
    Ok(Optimised { world_from_body, chi2_before, chi2_after, extra_chi2, iterations, converged })
}

fn check(graph: &PoseGraph, extra: &[PoseEdge], options: &OptimiseOptions) -> Result<(), OptimiseError> {
    let scale = options.loop_kernel.map(|kernel| ("a kernel's scale", kernel.scale()));
    for (what, value) in [("a tolerance", options.tolerance)].into_iter().chain(scale) {
        if !(value > 0.0 && value.is_finite()) {
            return Err(OptimiseError::Option { what, value });
        }
    }
    for (index, edge) in extra.iter().enumerate() {
        let (from, to) = (edge.from, edge.to);
        graph.check_edge(edge).map_err(|fault| OptimiseError::Edge { index, from, to, fault })?;
    }
    Ok(graph.check_connected(extra)?)
}

fn shifted(pose: &Isometry3<f64>, by: Vector3<f64>) -> Isometry3<f64> {
    Isometry3::from_parts((pose.translation.vector + by).into(), pose.rotation)
}
