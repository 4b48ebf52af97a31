//! The sum of squares of a graph, and its slopes.

use dmp_sensor::{Isometry3, PoseEdge, PoseGraph};

use super::cholesky::{Meeting, Model, System};
use super::kernel::Kernel;
use super::residual::{Slope, bend, moved, residual, slope};
use nalgebra::Vector6;

/// A sum of squares over the poses of a graph, some of which are held where they are.
#[derive(Debug)]
pub(super) struct Problem<'a> {
    terms: Vec<Term<'a>>,
    /// By vertex: its place among the variables; `None` where it is held.
    variable: Vec<Option<usize>>,
    system: System,
    right: Vec<Vector6<f64>>,
}

#[derive(Debug)]
struct Term<'a> {
    edge: &'a PoseEdge,
    from: usize,
    to: usize,
    /// Where the two poses meet, if neither is held.
    meeting: Option<Meeting>,
    kernel: Option<Kernel>,
}

impl<'a> Problem<'a> {
    /// The edges of a graph, its loops with the kernel, and more edges. The first vertex is held where none is fixed.
    pub(super) fn new(graph: &'a PoseGraph, extra: &'a [PoseEdge], loop_kernel: Option<Kernel>) -> Self {
        let is_held = |index: usize, id: &i64| match graph.fixed() {
            [] => index == 0,
            fixed => fixed.binary_search(id).is_ok(),
        };
        let mut variables = 0;
        let variable: Vec<Option<usize>> = (graph.ids().iter().enumerate())
            .map(|(index, id)| {
                (!is_held(index, id)).then(|| {
                    variables += 1;
                    variables - 1
                })
            })
            .collect();
        let own = graph.edges().iter().map(|edge| (edge, loop_kernel));
        let mut terms: Vec<Term<'a>> = (own.chain(extra.iter().map(|edge| (edge, None))))
            .filter_map(|(edge, kernel)| {
                let (from, to) = (graph.index_of(edge.from)?, graph.index_of(edge.to)?);
                let kernel = kernel.filter(|_| from.abs_diff(to) != 1);
                Some(Term { edge, from, to, meeting: None, kernel })
            })
            .collect();
        let tie = |term: &Term<'_>| variable[term.from].zip(variable[term.to]);
        let system = System::new(variables, terms.iter().filter_map(tie));
        for term in &mut terms {
            term.meeting = tie(term).and_then(|(from, to)| system.meeting(from, to));
        }
        Self { terms, variable, system, right: vec![Vector6::zeros(); variables] }
    }

    /// The sum of squares, without kernels.
    pub(super) fn chi2(&self, poses: &[Isometry3<f64>]) -> f64 {
        self.terms.iter().map(|term| term.chi2(poses)).sum()
    }

    /// The squares of the last edges, in their order.
    pub(super) fn chi2_of_last(&self, count: usize, poses: &[Isometry3<f64>]) -> Vec<f64> {
        self.terms.iter().skip(self.terms.len() - count).map(|term| term.chi2(poses)).collect()
    }

    /// What is made small: the sum of squares after kernels.
    pub(super) fn cost(&self, poses: &[Isometry3<f64>]) -> f64 {
        let cost = |term: &Term<'_>| {
            let chi2 = term.chi2(poses);
            term.kernel.map_or(chi2, |kernel| kernel.cost(chi2))
        };
        self.terms.iter().map(cost).sum()
    }

    /// First and second derivatives at these poses, for [`Problem::step`].
    pub(super) fn linearise(&mut self, poses: &[Isometry3<f64>]) {
        self.system.clear();
        self.right.fill(Vector6::zeros());
        for term in &self.terms {
            let (from, to) = (&poses[term.from], &poses[term.to]);
            let Slope { residual, by_from, by_to } = slope(term.edge, from, to);
            let (mut information, mut weight_slope) = (term.edge.information, 0.0);
            let bare_pull = information * residual;
            let mut pull = bare_pull;
            if let Some(kernel) = term.kernel {
                let chi2 = bare_pull.dot(&residual);
                information *= kernel.weight(chi2);
                pull *= kernel.weight(chi2);
                weight_slope = kernel.weight_slope(chi2);
            }
            let mut bend = bend(term.edge, from, to, &pull);
            if weight_slope != 0.0 {
                let (at_from, at_to) = (by_from.tr_mul(&bare_pull), by_to.tr_mul(&bare_pull));
                bend.from_from += at_from * at_from.transpose() * (2.0 * weight_slope);
                bend.from_to += at_from * at_to.transpose() * (2.0 * weight_slope);
                bend.to_to += at_to * at_to.transpose() * (2.0 * weight_slope);
            }
            let (from_pull, to_pull) = (information * by_from, information * by_to);
            if let Some(variable) = self.variable[term.from] {
                self.right[variable] -= by_from.tr_mul(&pull);
                self.system.add_diagonal(variable, &by_from.tr_mul(&from_pull), &bend.from_from);
            }
            if let Some(variable) = self.variable[term.to] {
                self.right[variable] -= by_to.tr_mul(&pull);
                self.system.add_diagonal(variable, &by_to.tr_mul(&to_pull), &bend.to_to);
            }
            if let Some(meeting) = term.meeting {
                self.system.add_meeting(meeting, &by_from.tr_mul(&to_pull), &bend.from_to);
            }
        }
    }

    /// The step of each variable to where the model is least; `None` where the model has no minimum, numerically.
    pub(super) fn step(&mut self, model: Model) -> Option<Vec<Vector6<f64>>> {
        let mut step = self.right.clone();
        self.system.solve(model, &mut step)?;
        Some(step)
    }

    /// How fast the cost grows along a step from where the problem was linearised.
    pub(super) fn slope_along(&self, step: &[Vector6<f64>]) -> f64 {
        -2.0 * self.right.iter().zip(step).map(|(right, step)| right.dot(step)).sum::<f64>()
    }

    /// The poses after a share of a step.
    pub(super) fn moved(
        &self,
        poses: &[Isometry3<f64>],
        step: &[Vector6<f64>],
        share: f64,
    ) -> Vec<Isometry3<f64>> {
        let moved = |(pose, variable): (&Isometry3<f64>, &Option<usize>)| {
            variable.map_or(*pose, |variable| moved(pose, &(step[variable] * share)))
        };
        poses.iter().zip(&self.variable).map(moved).collect()
    }

    /// Whether a vertex is held where it is.
    pub(super) fn is_held(&self, vertex: usize) -> bool {
        self.variable[vertex].is_none()
    }
}

impl Term<'_> {
    fn chi2(&self, poses: &[Isometry3<f64>]) -> f64 {
        let residual = residual(self.edge, &poses[self.from], &poses[self.to]);
        (self.edge.information * residual).dot(&residual)
    }
}
