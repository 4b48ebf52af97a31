//! Options of `dmp drift`, `dmp repair`, `dmp loops` and `dmp calibrate`.

use std::path::PathBuf;

use dmp::{DriftPairs, DriftReach};
use dmp_loops::Kernel;

use super::Group::{Acceptance, Graph, Input, Output, ReturnsAndMap, Speed};
use super::values::{self, from_one, parsed};
use super::{Opt, Role};

/// `none`, or a kernel and its scale.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LoopKernel(pub(crate) Option<Kernel>);

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

pub(crate) static PAIRS: Opt<DriftPairs> = Opt {
    help: "Measure at most N pairs of visits, evenly spread over the drive, or `all`. Default: all",
    ..Opt::text(ReturnsAndMap, "pairs", "N", "50", values::some_pairs)
};
pub(crate) static FAR: Opt<bool> = Opt {
    sets: Some(|config, _| config.drift_reach = DriftReach::Far),
    help: "Also find visits of runs that are off by 10 to about 25 m: pairs up to 40 m apart (default 15), registered from up \
           to 21 m away (default 6). Several times slower",
    ..Opt::switch(ReturnsAndMap, "far")
};
pub(crate) static CONSTRAINTS: Opt<PathBuf> = Opt {
    short: Some('o'),
    help: "Write the measured pairs as pose-graph constraints, FILE.g2o: an `EDGE_SE3:QUAT` with its information for each, \
           between scans by their numbers. For one run",
    ..Opt::path(Output, "output", "FILE", Role::Written)
};
pub(crate) static VISITS: Opt<bool> = Opt {
    short: Some('v'),
    conflicts: &[&super::output::JSON],
    help: "Also print every pair of visits",
    ..Opt::switch(Output, "verbose")
};
pub(crate) static PLOTS: Opt<PathBuf> = Opt {
    help: "Draw the thickness of surfaces over each parameter, as SVG in this folder; it is created if missing. Takes ten times \
           as long",
    ..Opt::path(Output, "plots", "FOLDER", Role::Pictures)
};

pub(crate) static ROUNDS: Opt<usize> = Opt {
    help: "Register visits at most N times, each time from the last result. Default: 3",
    ..Opt::text(ReturnsAndMap, "rounds", "N", "2", from_one)
};
pub(crate) static REPAIRED: Opt<PathBuf> = Opt {
    help: "The repaired run: TUM, or KITTI rows where the run has no stamps. Written only if the run gets better",
    ..Opt::output(Output, "FILE")
};
pub(crate) static REPAIRED_GRAPH: Opt<PathBuf> = Opt {
    help: "Also write the keyframes, their edges and the accepted loops, optimised, in g2o format",
    ..Opt::path(Output, "save-graph", "FILE.g2o", Role::Written)
};

pub(crate) static GRAPH: Opt<PathBuf> = Opt {
    help: "The graph without the candidates, in g2o's text format: `VERTEX_SE3:QUAT`, a keyframe each, and `EDGE_SE3:QUAT`",
    ..Opt::argument("graph", "GRAPH.g2o")
};
pub(crate) static CANDIDATES: Opt<PathBuf> = Opt {
    is_needed: true,
    help: "The loop candidates: `EDGE_SE3:QUAT` lines between vertices of the graph",
    ..Opt::path(Input, "candidates", "FILE.g2o", Role::Read)
};
pub(crate) static LOG_OF_GRAPH: Opt<PathBuf> = Opt {
    help: "The log with the scans, as for `dmp score`. Without it candidates are ranked by the graph alone",
    ..Opt::path(Input, "log", "LOG", Role::Read)
};
pub(crate) static LABELS: Opt<PathBuf> = Opt {
    help: "Which candidates are true: lines `FROM,TO,true` or `FROM,TO,false`. Prints precision, recall and average precision",
    ..Opt::path(Input, "truth", "LABELS", Role::Read)
};
pub(crate) static STEP_ERROR: Opt<(f64, f64)> = Opt {
    help: "Standard deviations of steps, edges between vertices with ids that follow each other. Default: those of the file, \
           else 1cm,1mrad",
    ..Opt::text(Graph, "step-error", "LENGTH,ANGLE", "1cm,1mrad", values::errors)
};
pub(crate) static LOOP_ERROR: Opt<(f64, f64)> = Opt {
    help: "Standard deviations of loops and candidates. Default: those of the files, else 0.7m,40deg",
    ..Opt::text(Graph, "loop-error", "LENGTH,ANGLE", "10cm,0.5deg", values::errors)
};
pub(crate) static LOOP_KERNEL: Opt<LoopKernel> = Opt {
    help: "A robust kernel for the loops of the graph, never for a candidate: `none`, `cauchy:SCALE` or `huber:SCALE`. Default: \
           none; cauchy:1 where the file has no information matrices",
    ..Opt::text(Graph, "loop-kernel", "KERNEL", "huber:1.5", parsed)
};
pub(crate) static ACCEPT: Opt<bool> = Opt {
    help: "Then add candidates from best to worst. Accept each whose change makes the score worse by at most a tenth, by the \
           99 % interval",
    ..Opt::switch(Acceptance, "accept")
};
pub(crate) static RAYS: Opt<usize> = Opt {
    requires: &[&LOG_OF_GRAPH],
    conflicts: &[&DIRECT],
    help: "Rays of each keyframe that are cast into each map, at most a million in all. Default: 2048",
    ..Opt::text(Speed, "rays", "N", "100", parsed)
};
pub(crate) static MOVED: Opt<f64> = Opt {
    requires: &[&LOG_OF_GRAPH],
    conflicts: &[&DIRECT],
    is_signed: true,
    help: "A place where nothing moved further than this keeps its score, metres; 0 casts everything again. Default: 0.02, in \
           a room 0.002",
    ..Opt::text(Speed, "moved", "METRES", "0", values::length_m)
};
pub(crate) static DIRECT: Opt<bool> = Opt {
    requires: &[&LOG_OF_GRAPH],
    conflicts: &[&ACCEPT],
    help: "Read the log again for each candidate, fuse its map from all returns and cast all of them: slow, and exact",
    ..Opt::switch(Speed, "direct")
};
pub(crate) static CURVE: Opt<PathBuf> = Opt {
    requires: &[&LABELS],
    help: "Draw precision over recall; needs --truth",
    ..Opt::path(Output, "svg", "FILE.svg", Role::Written)
};
pub(crate) static ACCEPTED_GRAPH: Opt<PathBuf> = Opt {
    requires: &[&ACCEPT],
    help: "Write the graph with the accepted loops, optimised, in g2o format",
    ..Opt::path(Acceptance, "save-graph", "FILE.g2o", Role::Written)
};
pub(crate) static ACCEPTED_POSES: Opt<PathBuf> = Opt {
    requires: &[&ACCEPT],
    help: "Write its poses: TUM where keyframes have times, else KITTI rows",
    ..Opt::path(Acceptance, "save-trajectory", "FILE", Role::Written)
};
