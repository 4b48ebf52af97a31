//! Files of what was found.

use dmp_draw::plot::{Axis, Plot, Point, Series, Style};
use dmp_draw::text::digits;
use dmp_log::write_pose_graph;
use dmp_loops::Keyframes;
use dmp_sensor::Trajectory;

use super::inputs::Inputs;
use super::ranked::Ranked;
use super::result::{LoopsResult, TruthResult};
use crate::files::{save, save_text, save_trajectory};
use crate::options::{Asked, graph};

/// Writes the files.
pub(super) fn write(
    asked: &Asked,
    result: &LoopsResult,
    inputs: &Inputs,
    ranked: &Ranked,
    keyframes: Option<&Keyframes>,
) -> anyhow::Result<()> {
    let drawn = match (asked.get(&graph::CURVE), &result.truth, &result.truth_withheld) {
        (Some(path), Some(truth), _) => save_text(&path, &curve(truth, result.config.ranked_by).to_svg()),
        (Some(path), None, Some(why)) => Err(anyhow::anyhow!("{}: there is no curve: {why}", path.display())),
        _ => Ok(()),
    };
    let Some(accepted) = &ranked.accepted else { return drawn };
    if let Some(path) = asked.get(&graph::ACCEPTED_GRAPH) {
        save(&path, |out| write_pose_graph(out, &accepted.graph))?;
    }
    if let Some(path) = asked.get(&graph::ACCEPTED_POSES) {
        let poses = accepted.graph.poses();
        let trajectory = match (keyframes, &inputs.stamps_ns) {
            (Some(keyframes), _) => keyframes.run("graph", poses)?.trajectory,
            (None, Some(stamps)) => {
                Keyframes::at(stamps.clone(), poses.len())?.run("graph", poses)?.trajectory
            }
            (None, None) => Trajectory::unstamped(poses.to_vec())?,
        };
        save_trajectory(&path, &trajectory)?;
    }
    drawn
}

/// Precision over recall, as in fig. 3 of Zhang & Chen 2021.
fn curve(truth: &TruthResult, ranked_by: &str) -> Plot {
    let axis = |title: &str| Axis { title: title.to_owned(), log: false };
    let point = |recall: f64, precision: f64| Point { x: recall, y: precision, name: String::new() };
    let mut points: Vec<Point> =
        truth.curve.first().map(|first| point(0.0, first.precision)).into_iter().collect();
    points.extend(truth.curve.iter().map(|at| point(at.recall, at.precision)));
    Plot {
        title: "Loop candidates".to_owned(),
        subtitle: format!(
            "average precision {}, {} true and {} false",
            digits(truth.average_precision),
            truth.true_candidates,
            truth.false_candidates
        ),
        x: axis("recall: share of the true loops that is accepted"),
        y: axis("precision: share of the accepted loops that is true"),
        x_names: Vec::new(),
        series: vec![Series { name: format!("ranked by {ranked_by}"), points, style: Style::Joined }],
    }
}
