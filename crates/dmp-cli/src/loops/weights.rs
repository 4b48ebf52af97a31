//! What the measurements of a graph count.

use clap::Args;
use dmp_loops::Kernel;
use dmp_sensor::{PoseEdge, PoseGraph, PoseGraphError};

use crate::parse;

/// Standard deviations that tools write into their code whose files have no information (SC-LIO-SAM, SC-A-LOAM, SC-DLO):
/// of a step 1 cm and 1 mrad, of a loop the root of one half in metres and radians, with Cauchy's kernel.
const STEP: (f64, f64) = (0.01, 0.001);
const LOOP: (f64, f64) = (std::f64::consts::FRAC_1_SQRT_2, std::f64::consts::FRAC_1_SQRT_2);
const KERNEL: LoopKernel = LoopKernel(Some(Kernel::Cauchy(1.0)));

#[derive(Debug, Args)]
pub(super) struct WeightArgs {
    /// How good steps are, edges between vertices whose ids follow each other: standard deviations of place and rotation,
    /// e.g. 1cm,1mrad [default: what the file says; where it says nothing, 1cm,1mrad]
    #[arg(long, value_name = "LENGTH,ANGLE", value_parser = parse::errors, help_heading = "Graph")]
    step_error: Option<(f64, f64)>,
    /// How good loops and candidates are, e.g. 10cm,0.5deg [default: what the files say; where they say nothing,
    /// 0.7m,40deg]
    #[arg(long, value_name = "LENGTH,ANGLE", value_parser = parse::errors, help_heading = "Graph")]
    loop_error: Option<(f64, f64)>,
    /// A robust kernel for the loops that the graph has already, never for a candidate: `none`, `cauchy:SCALE` or
    /// `huber:SCALE` [default: none; cauchy:1 where the file says nothing of how good edges are]
    #[arg(long, value_name = "KERNEL", help_heading = "Graph")]
    loop_kernel: Option<LoopKernel>,
}

/// `none`, or a kernel and its scale.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LoopKernel(pub(super) Option<Kernel>);

impl std::str::FromStr for LoopKernel {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let scale = |scale: &str| scale.parse::<f64>().ok().filter(|scale| *scale > 0.0 && scale.is_finite());
        match text.split_once(':') {
            None if text == "none" => Some(Self(None)),
            Some(("cauchy", text)) => scale(text).map(|scale| Self(Some(Kernel::Cauchy(scale)))),
            Some(("huber", text)) => scale(text).map(|scale| Self(Some(Kernel::Huber(scale)))),
            _ => None,
        }
        .ok_or_else(|| format!("`{text}` is no kernel: try none, cauchy:1 or huber:1.5"))
    }
}

/// What takes effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Weights {
    /// Metres and radians; `None` for what the files say.
    pub(super) step_error: Option<(f64, f64)>,
    pub(super) loop_error: Option<(f64, f64)>,
    pub(super) kernel: Option<Kernel>,
    /// Whether it was given by nobody.
    pub(super) is_guessed: bool,
}

impl WeightArgs {
    /// For files with or without information.
    pub(super) fn of(&self, has_information: bool) -> Weights {
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
}

impl WeightArgs {
    /// A candidate as good as was given, or as it says itself, or where neither is so as loops of the graph are taken to be.
    pub(super) fn of_candidate(&self, edge: &PoseEdge, weights: &Weights) -> PoseEdge {
        let says_nothing = edge.information == PoseGraph::unit_information();
        weighted(edge, self.loop_error.or(weights.loop_error.filter(|_| says_nothing)))
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
