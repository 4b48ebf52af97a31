//! The weights of a graph's measurements.

use dmp_loops::Kernel;
use dmp_sensor::{PoseEdge, PoseGraph, PoseGraphError};

use crate::options::graph::LoopKernel;
use crate::options::{Asked, graph};

/// Standard deviations that tools write into their code whose files have no information (SC-LIO-SAM, SC-A-LOAM, SC-DLO):
/// of a step 1 cm and 1 mrad, of a loop the root of one half in metres and radians, with Cauchy's kernel.
const STEP: (f64, f64) = (0.01, 0.001);
const LOOP: (f64, f64) = (std::f64::consts::FRAC_1_SQRT_2, std::f64::consts::FRAC_1_SQRT_2);
const KERNEL: LoopKernel = LoopKernel(Some(Kernel::Cauchy(1.0)));

/// The weights that were given.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct GivenWeights {
    step_error: Option<(f64, f64)>,
    loop_error: Option<(f64, f64)>,
    loop_kernel: Option<LoopKernel>,
}

/// What takes effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Weights {
    /// Metres and radians; `None`: those of the files.
    pub(super) step_error: Option<(f64, f64)>,
    pub(super) loop_error: Option<(f64, f64)>,
    pub(super) kernel: Option<Kernel>,
    /// Whether it is assumed.
    pub(super) is_guessed: bool,
}

impl GivenWeights {
    pub(super) fn of(asked: &Asked) -> Self {
        Self {
            step_error: asked.get(&graph::STEP_ERROR),
            loop_error: asked.get(&graph::LOOP_ERROR),
            loop_kernel: asked.get(&graph::LOOP_KERNEL),
        }
    }

    /// For files with or without information.
    pub(super) fn weights(&self, has_information: bool) -> Weights {
        let Self { step_error, loop_error, loop_kernel } = *self;
        if has_information {
            let kernel = loop_kernel.and_then(|kernel| kernel.0);
            return Weights { step_error, loop_error, kernel, is_guessed: false };
        }
        Weights {
            step_error: Some(step_error.unwrap_or(STEP)),
            loop_error: Some(loop_error.unwrap_or(LOOP)),
            kernel: loop_kernel.unwrap_or(KERNEL).0,
            is_guessed: step_error.is_none() || loop_error.is_none(),
        }
    }

    /// A candidate with the given weight, else with its own, else with that of the graph's loops.
    pub(super) fn of_candidate(&self, edge: &PoseEdge, weights: &Weights) -> PoseEdge {
        let is_unweighted = edge.information == PoseGraph::unit_information();
        weighted(edge, self.loop_error.or(weights.loop_error.filter(|_| is_unweighted)))
    }
}

impl Weights {
    /// The graph with its edges weighted so.
    pub(super) fn of_graph(&self, graph: &PoseGraph) -> Result<PoseGraph, PoseGraphError> {
        let is_step = |edge: &PoseEdge| {
            let [from, to] = [edge.from, edge.to].map(|id| graph.index_of(id));
            from.zip(to).is_some_and(|(from, to)| from.abs_diff(to) == 1)
        };
        let weigh = |edge: &PoseEdge| {
            let error = if is_step(edge) { self.step_error } else { self.loop_error };
            weighted(edge, error)
        };
        let vertices = graph.ids().iter().copied().zip(graph.poses().iter().copied()).collect();
        PoseGraph::new(
            vertices,
            graph.edges().iter().map(weigh).collect(),
            graph.fixed().iter().copied().collect(),
        )
    }
}

fn weighted(edge: &PoseEdge, error: Option<(f64, f64)>) -> PoseEdge {
    let Some((metres, radians)) = error else { return edge.clone() };
    let information = PoseGraph::information_of(metres, radians);
    PoseEdge { information, ..edge.clone() }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use dmp_sensor::{Isometry3, Matrix6};

    use super::*;

    const GIVEN: [Option<(f64, f64)>; 2] = [None, Some((0.1, 0.01))];

    fn of((metres, radians): (f64, f64)) -> Matrix6<f64> {
        PoseGraph::information_of(metres, radians)
    }

    fn edge(from: i64, to: i64, information: &Matrix6<f64>) -> PoseEdge {
        PoseEdge { from, to, from_from_to: Isometry3::identity(), information: *information }
    }

    fn given(step_error: Option<(f64, f64)>, loop_error: Option<(f64, f64)>) -> GivenWeights {
        GivenWeights { step_error, loop_error, loop_kernel: None }
    }

    /// The weight of each edge of a graph, whose ids have gaps: two steps, one of them backwards, and two loops.
    fn of_edges(weights: &Weights, own: &Matrix6<f64>) -> [Matrix6<f64>; 4] {
        let vertices = [2, 5, 6, 9].map(|id| (id, Isometry3::identity())).into();
        let edges = [(2, 5), (6, 5), (5, 9), (6, 2)].map(|(from, to)| edge(from, to, own));
        let graph = PoseGraph::new(vertices, edges.to_vec(), BTreeSet::from([5])).unwrap();
        let weighted = weights.of_graph(&graph).unwrap();
        assert_eq!((weighted.ids(), weighted.poses()), (graph.ids(), graph.poses()));
        assert_eq!(weighted.fixed(), graph.fixed());
        let weighted = weighted.edges();
        assert!(weighted.iter().zip(&edges).all(|(a, b)| (a.from, a.to) == (b.from, b.to)));
        std::array::from_fn(|k| weighted[k].information)
    }

    #[test]
    fn edges_have_the_given_weights_else_their_own_else_the_usual_ones() {
        let (own, unit) = (of((0.3, 0.03)), PoseGraph::unit_information());
        for (step, of_loop) in GIVEN.iter().flat_map(|step| GIVEN.map(|of_loop| (*step, of_loop))) {
            let weights = given(step, of_loop).weights(true);
            let [steps, loops] = [step, of_loop].map(|error| error.map_or(own, of));
            assert_eq!(of_edges(&weights, &own), [steps, steps, loops, loops]);
            assert_eq!((weights.kernel, weights.is_guessed), (None, false));

            let weights = given(step, of_loop).weights(false);
            let [steps, loops] = [step.unwrap_or(STEP), of_loop.unwrap_or(LOOP)].map(of);
            assert_eq!(of_edges(&weights, &unit), [steps, steps, loops, loops]);
            assert_eq!(weights.is_guessed, step.is_none() || of_loop.is_none());
            assert_eq!(weights.kernel, Some(Kernel::Cauchy(1.0)));
        }
        for (loop_error, has_information, of_candidate, expected) in [
            (None, true, own, own),
            (None, false, own, own),
            (GIVEN[1], true, own, of((0.1, 0.01))),
            (GIVEN[1], false, unit, of((0.1, 0.01))),
            // As loops of a graph without weights, or unchanged.
            (None, false, unit, of(LOOP)),
            (None, true, unit, unit),
        ] {
            let (given, candidate) = (given(None, loop_error), edge(9, 2, &of_candidate));
            let weighted = given.of_candidate(&candidate, &given.weights(has_information));
            assert_eq!(weighted, PoseEdge { information: expected, ..candidate });
        }
    }

    #[test]
    fn a_kernel_is_what_was_given() {
        for (text, kernel) in [
            ("none", None),
            ("huber:1.5", Some(Kernel::Huber(1.5))),
            ("cauchy:0.1", Some(Kernel::Cauchy(0.1))),
        ] {
            let given = GivenWeights { loop_kernel: Some(text.parse().unwrap()), ..given(None, None) };
            assert_eq!([true, false].map(|has| given.weights(has).kernel), [kernel; 2]);
        }
        for text in ["", "huber", "none:1", "cauchy:0", "cauchy:-1", "huber:inf", "huber:NaN", "tukey:1"] {
            assert!(text.parse::<LoopKernel>().unwrap_err().starts_with(&format!("`{text}` is no kernel")));
        }
    }
}
