//! Which constraints agree with each other, and the error of the run's own steps.

use dmp_sensor::PoseEdge;

use super::chain::{Chain, StepError};
use crate::{Kernel, LoopError, OptimiseOptions, optimise};

/// What 1 in 100 right constraints exceeds: the quantile .99 of chi² with six degrees of freedom.
const LARGEST_CHI2: f64 = 16.811_893_829_770_927;
/// Directions of a constraint.
pub(super) const DIRECTIONS: f64 = 6.0;
/// Standard deviations beyond which a constraint counts for less while it is estimated which agree.
const KERNEL: f64 = 3.0;
/// Bounds of the factor by which the steps err more than usual.
const FACTORS: std::ops::RangeInclusive<f64> = 0.01..=100.0;

/// Constraints that agree with each other.
#[derive(Debug)]
pub(super) struct Consistent {
    /// Which, in their order.
    pub(super) kept: Vec<usize>,
    /// Error of the run's steps, estimated from the constraints.
    pub(super) error: StepError,
}

/// Finds the constraints that agree.
///
/// The error of the steps is the median of what each constraint needs alone: half of them may be wrong. With that error all are
/// optimised together, under Cauchy's kernel. Those that do not fit are rejected, the worst first, until all fit.
pub(super) fn consistent(
    chain: &Chain,
    edges: &[PoseEdge],
    usual: StepError,
    options: &OptimiseOptions,
) -> Result<Consistent, LoopError> {
    let error = usual.times(factor(chain, edges, usual, options)?);
    let alone = chain.graph(error)?;
    let robust = OptimiseOptions { loop_kernel: Some(Kernel::Cauchy(KERNEL)), ..options.clone() };
    let joined = edges.iter().try_fold(alone.clone(), |graph, edge| graph.with_edge(edge.clone()))?;
    let settled = optimise(&joined, &[], &robust).map_err(LoopError::Graph)?;
    // Only the constraints' edges have squares of their own.
    let at = alone.with_poses(settled.world_from_body)?;
    let mut kept: Vec<usize> = (0..edges.len()).collect();
    let of = |at: &dmp_sensor::PoseGraph, kept: &[usize], steps: usize| {
        let extra: Vec<PoseEdge> = kept.iter().map(|&k| edges[k].clone()).collect();
        let options = OptimiseOptions { most_iterations: steps, ..options.clone() };
        optimise(at, &extra, &options).map_err(LoopError::Graph)
    };
    let chi2 = of(&at, &kept, 0)?.extra_chi2;
    kept.retain(|&k| chi2[k] <= LARGEST_CHI2);
    while !kept.is_empty() {
        let chi2 = of(&at, &kept, options.most_iterations)?.extra_chi2;
        let worst = (0..kept.len()).max_by(|&a, &b| chi2[a].total_cmp(&chi2[b]));
        match worst {
            Some(worst) if chi2[worst] > LARGEST_CHI2 => kept.remove(worst),
            _ => break,
        };
    }
    Ok(Consistent { kept, error })
}

/// Factor by which the steps err more than usual: the median over single constraints.
pub(super) fn factor(
    chain: &Chain,
    edges: &[PoseEdge],
    usual: StepError,
    options: &OptimiseOptions,
) -> Result<f64, LoopError> {
    let graph = chain.graph(usual)?;
    let mut needed = Vec::with_capacity(edges.len());
    for edge in edges {
        let found = optimise(&graph, std::slice::from_ref(edge), options).map_err(LoopError::Graph)?;
        needed.push((found.chi2_after / DIRECTIONS).sqrt());
    }
    needed.sort_by(f64::total_cmp);
    let median = needed.get(needed.len() / 2).copied().unwrap_or(1.0);
    Ok(median.clamp(*FACTORS.start(), *FACTORS.end()))
}

/// The squares of the constraints where the run has its poses.
pub(super) fn misfit(chain: &Chain, edges: &[PoseEdge], options: &OptimiseOptions) -> Result<f64, LoopError> {
    let graph = chain.graph(StepError::default())?;
    let options = OptimiseOptions { most_iterations: 0, ..options.clone() };
    Ok(optimise(&graph, edges, &options).map_err(LoopError::Graph)?.extra_chi2.iter().sum())
}
