//! Trajectories from above and from the side.

use super::{TruthPlots, TruthRun};
use crate::plot::{Axis, Plot, Point, Series, Style};

/// Points of a way at most.
const MOST: usize = 1500;
/// Coordinates are shown from a round place on where they are larger than this, metres.
const FAR_M: f64 = 10_000.0;

/// The plane that is looked at: the numbers of its axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Side {
    /// x and y.
    Above,
    /// x and z.
    Front,
}

impl Side {
    fn axes(self) -> [usize; 2] {
        match self {
            Self::Above => [0, 1],
            Self::Front => [0, 2],
        }
    }

    fn words(self) -> &'static str {
        match self {
            Self::Above => "from above",
            Self::Front => "from the side",
        }
    }
}

/// Coordinates from a round place on, as UTM's are too long to be read.
#[derive(Debug, Clone, Copy)]
struct Origin {
    side: Side,
    from_m: [f64; 2],
}

impl Origin {
    fn of(plots: &TruthPlots, side: Side) -> Self {
        let first = plots.runs.first().and_then(|run| run.poses.first());
        let from = |axis: usize| {
            let at_m = first.map_or(0.0, |pose| pose.positions_m[0][axis]);
            if at_m.abs() > FAR_M { (at_m / 1000.0).floor() * 1000.0 } else { 0.0 }
        };
        Self { side, from_m: side.axes().map(from) }
    }

    fn axis(&self, k: usize) -> Axis {
        let name = ["x", "y", "z"][self.side.axes()[k]];
        let title = match self.from_m[k] {
            0.0 => format!("{name} [m]"),
            from_m => format!("{name} − {from_m} [m]").replace("− -", "+ "),
        };
        Axis { title, log: false }
    }

    fn point(&self, at_m: &[f64; 3]) -> Point {
        let [x, y] = self.side.axes();
        Point { x: at_m[x] - self.from_m[0], y: at_m[y] - self.from_m[1], name: String::new() }
    }

    fn plot(&self, title: String, series: Vec<Series>) -> Plot {
        Plot { title, x: self.axis(0), y: self.axis(1), series, ..Plot::default() }
    }
}

const NO_PLACE: Point = Point { x: f64::NAN, y: f64::NAN, name: String::new() };

/// The way of a run, coloured by its errors from 0 to `top`, over that of the reference.
pub(crate) fn coloured_way(plots: &TruthPlots, run: &TruthRun, top: f64, side: Side) -> Plot {
    let from = Origin::of(plots, side);
    let shades = shades(run, top);
    // Of every few poses the worst one, so that no peak is lost.
    let kept = thinned(run.poses.len(), |pose| shades[pose].unwrap_or(0));
    let mut series: Vec<Series> = Vec::new();
    for shade in (0..crate::colour::STEPS).rev() {
        let mut points: Vec<Point> = Vec::new();
        for pair in kept.windows(2).filter(|pair| shades[pair[1]] == Some(shade)) {
            let [a, b] = [pair[0], pair[1]].map(|pose| from.point(&run.poses[pose].positions_m[1]));
            if points.last() != Some(&a) {
                points.extend([NO_PLACE, a]);
            }
            points.push(b);
        }
        if !points.is_empty() {
            series.push(Series { name: String::new(), points, style: Style::Shade(shade) });
        }
    }
    series.push(reference(run, &from));
    from.plot(format!("Path of {} {}, coloured by error", run.name, side.words()), series)
}

/// The ways of several runs and of the reference.
pub(crate) fn ways_of_all(plots: &TruthPlots, runs: &[&TruthRun], side: Side) -> Plot {
    let from = Origin::of(plots, side);
    let way = |run: &&TruthRun| {
        let kept = thinned(run.poses.len(), |_| 0);
        let points = kept.into_iter().map(|pose| from.point(&run.poses[pose].positions_m[1])).collect();
        Series { name: run.name.clone(), points, style: Style::Line }
    };
    let mut series: Vec<Series> = runs.iter().map(way).collect();
    series.extend(runs.first().map(|run| reference(run, &from)));
    from.plot(format!("Paths of all runs {}", side.words()), series)
}

fn reference(run: &TruthRun, from: &Origin) -> Series {
    let kept = thinned(run.poses.len(), |_| 0);
    let points = kept.into_iter().map(|pose| from.point(&run.poses[pose].positions_m[0])).collect();
    Series { name: "reference".into(), points, style: Style::Reference }
}

/// The colour of each pose: that of its error, or of the next error that there is, as that of a pair says what happened on the
/// way to its end.
fn shades(run: &TruthRun, top: f64) -> Vec<Option<usize>> {
    let mut worst: Vec<Option<f64>> = vec![None; run.poses.len()];
    for &(pose, error) in &run.errors {
        if let Some(worst) = worst.get_mut(pose) {
            *worst = Some(worst.map_or(error, |other| other.max(error)));
        }
    }
    let mut next = None;
    for error in worst.iter_mut().rev() {
        next = error.or(next);
        *error = next;
    }
    let share = |error: f64| if top > 0.0 { error / top } else { 0.0 };
    worst.into_iter().map(|error| error.map(|error| crate::colour::step(share(error)))).collect()
}

/// First, last and of every few poses the one with the largest weight.
fn thinned(count: usize, weight: impl Fn(usize) -> usize) -> Vec<usize> {
    let every = count.div_ceil(MOST).max(1);
    let few = (0..count).step_by(every).map(|start| start..(start + every).min(count));
    // Of equal ones the first.
    let mut kept: Vec<usize> = few.filter_map(|few| few.rev().max_by_key(|&pose| weight(pose))).collect();
    if let Some(first) = kept.first_mut() {
        *first = 0;
    }
    kept.extend(count.checked_sub(1).filter(|last| kept.last() != Some(last)));
    kept
}

#[cfg(test)]
mod tests {
    use super::super::tests::plots;
    use super::*;

    #[test]
    fn a_way_has_the_colours_of_its_errors() {
        let plots = plots();
        let run = &plots.runs[0];
        let plot = coloured_way(&plots, run, plots.top(), Side::Above);
        let (reference, shades) = plot.series.split_last().unwrap();
        assert_eq!((reference.style, reference.points.len()), (Style::Reference, run.poses.len()));
        // As many pieces of way as there are steps from pose to pose.
        let steps = |s: &Series| s.points.windows(2).filter(|p| p.iter().all(|p| p.x.is_finite())).count();
        assert_eq!(shades.iter().map(steps).sum::<usize>(), run.poses.len() - 1);
        assert_eq!(shades[0].style, Style::Shade(14), "the worst is drawn last");
        let side = coloured_way(&plots, run, plots.top(), Side::Front);
        assert_eq!((side.y.title.as_str(), side.x.title.as_str()), ("z [m]", "x [m]"));
    }

    #[test]
    fn a_pair_colours_what_leads_to_its_end() {
        let mut plots = plots();
        plots.runs[0].errors = vec![(3, 1.0), (6, 2.0), (3, 0.5)];
        let shades = shades(&plots.runs[0], 2.0);
        assert_eq!(shades[..4], [Some(7); 4]);
        assert_eq!((shades[4], shades[6], shades[7]), (Some(14), Some(14), None));
        assert!(super::shades(&plots.runs[0], 0.0).contains(&Some(0)));
    }

    #[test]
    fn far_places_have_short_numbers() {
        let mut plots = plots();
        for pose in &mut plots.runs[0].poses {
            for place in &mut pose.positions_m {
                place[0] += 431_234.5;
                place[1] -= 5_000_100.0;
            }
        }
        let plot = coloured_way(&plots, &plots.runs[0], 1.0, Side::Above);
        assert_eq!((plot.x.title.as_str(), plot.y.title.as_str()), ("x − 431000 [m]", "y + 5001000 [m]"));
        assert!(plot.series.iter().flat_map(|s| &s.points).all(|p| p.x.is_nan() || p.x.abs() < 2000.0));
    }

    #[test]
    fn long_ways_keep_their_worst_poses() {
        let kept = thinned(100_000, |pose| usize::from(pose == 41_234));
        assert!(kept.len() <= MOST + 1 && kept.contains(&41_234) && kept.is_sorted());
        assert_eq!((kept.first(), kept.last()), (Some(&0), Some(&99_999)));
        assert_eq!((thinned(3, |_| 0), thinned(0, |_| 0)), (vec![0, 1, 2], vec![]));
    }
}
