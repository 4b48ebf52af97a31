//! Errors, places and angles over time and over way.

use super::{TruthPlots, TruthPose, TruthRun};
use crate::plot::{Axis, Plot, Point, Series, Style};

/// Points of a line at most: a plot has fewer pixels.
const MOST: usize = 1200;

/// What the horizontal axis is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Over {
    Time,
    Way,
}

impl Over {
    fn of(self, pose: &TruthPose) -> f64 {
        match self {
            Self::Time => pose.at,
            Self::Way => pose.way_m,
        }
    }

    fn axis(self, plots: &TruthPlots) -> Axis {
        axis(if self == Self::Time { plots.time_axis() } else { "path [m]" })
    }
}

/// How mean, median and rmse are drawn.
pub(crate) const LEVELS: [(&str, &str); 3] = [("mean", ""), ("median", "7 4"), ("rmse", "2 3")];

fn axis(title: &str) -> Axis {
    Axis { title: title.to_owned(), log: false }
}

fn series(name: &str, points: impl IntoIterator<Item = (f64, f64)>, style: Style) -> Series {
    let points = points.into_iter().map(|(x, y)| Point { x, y, name: String::new() }).collect();
    Series { name: name.to_owned(), points, style }
}

/// Of every few points the lowest and the highest, in their order.
pub(super) fn thinned(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    if points.len() <= MOST {
        return points.to_vec();
    }
    let few = points.chunks(points.len().div_ceil(MOST / 2));
    let ends = |few: &[(f64, f64)]| {
        let by = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
        let index = |point: Option<&(f64, f64)>| point.and_then(|point| few.iter().position(|p| p == point));
        let mut ends = [index(few.iter().min_by(by)), index(few.iter().max_by(by))];
        ends.sort_unstable();
        ends.into_iter().flatten().map(|at| few[at]).collect::<Vec<_>>()
    };
    few.flat_map(ends).collect()
}

/// Errors in the order of the axis: pairs may end in any.
fn errors(run: &TruthRun, over: Over) -> Vec<(f64, f64)> {
    let mut errors: Vec<(f64, f64)> =
        run.errors.iter().filter_map(|&(pose, error)| Some((over.of(run.poses.get(pose)?), error))).collect();
    errors.sort_by(|a, b| a.0.total_cmp(&b.0));
    errors
}

/// The errors of a run with mean, median, rmse and a band of one standard deviation about the mean.
pub(crate) fn error_over(plots: &TruthPlots, run: &TruthRun, over: Over) -> Plot {
    let errors = errors(run, over);
    let ends = [errors.first(), errors.last()].map(|end| end.map_or(f64::NAN, |end| end.0));
    let stats = &run.stats;
    let mut drawn = vec![series("error", thinned(&errors), Style::Line)];
    for ((name, dashes), level) in LEVELS.into_iter().zip([stats.mean, stats.median, stats.rmse]) {
        drawn.push(series(name, ends.map(|x| (x, level)), Style::Dashed(dashes)));
    }
    let (low, high) = ((stats.mean - stats.std).max(0.0), stats.mean + stats.std);
    let around = [(ends[0], low), (ends[1], low), (ends[1], high), (ends[0], high)];
    drawn.push(series("std", around, Style::Band));
    Plot {
        title: format!("Error of {} over {}", run.name, if over == Over::Time { "time" } else { "path" }),
        x: over.axis(plots),
        y: axis(&plots.error_axis()),
        series: drawn,
        ..Plot::default()
    }
}

/// The errors of several runs in one plot.
pub(crate) fn errors_of_all(plots: &TruthPlots, runs: &[&TruthRun], over: Over) -> Plot {
    let lines = runs.iter().map(|run| series(&run.name, thinned(&errors(run, over)), Style::Line));
    Plot {
        title: format!("Errors over {}", if over == Over::Time { "time" } else { "path" }),
        x: over.axis(plots),
        y: axis(&plots.error_axis()),
        series: lines.collect(),
        ..Plot::default()
    }
}

/// Which share of a run's errors is at most how large.
pub(crate) fn shares_of_all(plots: &TruthPlots, runs: &[&TruthRun]) -> Plot {
    let line = |run: &&TruthRun| {
        let mut values: Vec<f64> = run.errors.iter().map(|error| error.1).collect();
        values.sort_by(f64::total_cmp);
        let last = values.len().saturating_sub(1);
        let steps = last.clamp(1, MOST / 2);
        let at = |step: usize| {
            let at = last * step / steps;
            (values.get(at).copied().unwrap_or(f64::NAN), 100.0 * (at + 1) as f64 / values.len() as f64)
        };
        series(&run.name, (0..=steps).map(at), Style::Line)
    };
    Plot {
        title: "Which part of the errors is at most how large".into(),
        x: axis(&plots.error_axis()),
        y: axis("% of the errors"),
        series: runs.iter().map(line).collect(),
        ..Plot::default()
    }
}

/// A coordinate of the place, run and reference.
pub(crate) fn places(plots: &TruthPlots, run: &TruthRun, k: usize) -> Plot {
    let name = ["x", "y", "z"][k];
    let of = |which: usize| over_time(run, |pose| pose.positions_m[which][k]);
    beside(plots, run, &format!("{name} [m]"), name, [of(0), of(1)])
}

/// Roll, pitch or yaw, run and reference; lines end where the angle goes from one end of its range to the other.
pub(crate) fn angles(plots: &TruthPlots, run: &TruthRun, k: usize) -> Plot {
    let name = ["roll", "pitch", "yaw"][k];
    let of = |which: usize| broken(&over_time(run, |pose| pose.roll_pitch_yaw_deg[which][k]));
    beside(plots, run, &format!("{name} [deg]"), name, [of(0), of(1)])
}

fn over_time(run: &TruthRun, value: impl Fn(&TruthPose) -> f64) -> Vec<(f64, f64)> {
    thinned(&run.poses.iter().map(|pose| (pose.at, value(pose))).collect::<Vec<_>>())
}

fn broken(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut broken: Vec<(f64, f64)> = Vec::with_capacity(points.len());
    for &(x, y) in points {
        if broken.last().is_some_and(|last| (last.1 - y).abs() > 180.0) {
            broken.push((x, f64::NAN));
        }
        broken.push((x, y));
    }
    broken
}

fn beside(
    plots: &TruthPlots,
    run: &TruthRun,
    y: &str,
    name: &str,
    [reference, of_run]: [Vec<(f64, f64)>; 2],
) -> Plot {
    Plot {
        title: format!("{name} of {} and the reference over time", run.name),
        x: axis(plots.time_axis()),
        y: axis(y),
        series: vec![
            series(&run.name, of_run, Style::Line),
            series("reference", reference, Style::Reference),
        ],
        ..Plot::default()
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::plots;
    use super::*;

    #[test]
    fn thin_lines_keep_their_peaks() {
        let mut points: Vec<(f64, f64)> = (0..100_000).map(|k| (f64::from(k), 1.0)).collect();
        points[41_234].1 = 9.0;
        points[70_001].1 = -3.0;
        let thin = thinned(&points);
        assert!(thin.len() <= MOST && thin.is_sorted_by(|a, b| a.0 <= b.0));
        assert!(thin.contains(&(41_234.0, 9.0)) && thin.contains(&(70_001.0, -3.0)));
        assert_eq!(thinned(&points[..MOST]), points[..MOST]);
        assert_eq!(thinned(&[]), []);
    }

    #[test]
    fn levels_are_the_statistics() {
        let plots = plots();
        let plot = error_over(&plots, &plots.runs[0], Over::Way);
        let level = |name: &str| plot.series.iter().find(|s| s.name == name).unwrap().points[1].y;
        let stats = plots.runs[0].stats;
        assert_eq!((level("mean"), level("median"), level("rmse")), (stats.mean, stats.median, stats.rmse));
        assert_eq!((plot.x.title.as_str(), plot.y.title.as_str()), ("path [m]", "APE [m]"));
        let shares = shares_of_all(&plots, &[&plots.runs[0]]);
        let last = shares.series[0].points.last().unwrap();
        assert_eq!((last.x, last.y), (stats.max, 100.0));
    }

    #[test]
    fn angles_do_not_cross_the_plot_at_half_a_turn() {
        let around = [(0.0, 170.0), (1.0, 179.0), (2.0, -179.0), (3.0, -170.0)];
        let broken = broken(&around);
        assert!(broken.len() == 5 && broken[2].1.is_nan(), "{broken:?}");
    }
}
