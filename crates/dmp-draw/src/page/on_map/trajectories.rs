//! The trajectories of all runs, laid onto each other.

use std::fmt::Write as _;

use nalgebra::{Matrix3, Point3};

use crate::page::explore::with_data;
use crate::page::html::{figure, keys, large, paragraph};
use crate::page::on_map::overlay::Frame;
use crate::pictures::{Pictures, metre_decimals, time_of, travel_m};
use crate::plot::{Axis, Plot, Point, Series, Style, escape};
use crate::text::digits;
use crate::words::rigid;

/// Width of the picture in units of its drawing.
const WIDTH: f64 = 400.0;
/// A way that is less wide than this share of its length is drawn as if it were so wide.
const FLATTEST: f64 = 0.25;
/// Points of a way at most.
const POINTS: usize = 1200;

/// The ways of some runs, best first, from above; and what is said of them, with their heights over the way. `names` are
/// those of all runs.
pub(crate) fn trajectories(
    pictures: &Pictures,
    runs: &[usize],
    names: &[&str],
    size_px: [f64; 2],
) -> [String; 2] {
    let Some(&best) = runs.first().filter(|_| pictures.frames.len() > 1) else { return Default::default() };
    let ways: Vec<Vec<Point3<f64>>> = runs.iter().map(|&run| laid_onto(pictures, run, best)).collect();
    let named = runs.iter().enumerate().map(|(k, &run)| (format!("var(--s{k})"), names[run]));
    let key = keys(named).replacen("<ul class=\"keys\"", "<ul class=\"keys\" data-runs", 1);
    let text = paragraph(&format!(
        "Each run is aligned rigidly to {}; x and y are those of its world. Where the runs part, they disagree on the shape of the \
         path.",
        names[best]
    ));
    let above = from_above(pictures, runs, names, &ways);
    let heights = heights(pictures, runs, names, &ways).to_element(size_px[0], size_px[1]);
    let above = figure(&above, "all runs from above; a dot is the start");
    [key.clone() + &above, text + &key + &large(&figure(&heights, "height over the path"))]
}

/// The positions of a run in the world of another, on whose places they are laid as one piece.
fn laid_onto(pictures: &Pictures, run: usize, other: usize) -> Vec<Point3<f64>> {
    let of =
        |run: usize| pictures.frames.iter().map(move |frame| Point3::from(frame.position_in_world_m[run]));
    let motion = rigid(&of(run).zip(of(other)).map(|(from, onto)| [from, onto]), Matrix3::zeros());
    of(run).map(|point| motion * point).collect()
}

fn from_above(pictures: &Pictures, runs: &[usize], names: &[&str], ways: &[Vec<Point3<f64>>]) -> String {
    let points = || ways.iter().flatten().filter(|point| point.coords.iter().all(|m| m.is_finite()));
    let [low, high] = [f64::min, f64::max].map(|of: fn(f64, f64) -> f64| {
        [0, 1].map(|axis| points().map(|point| point[axis]).reduce(of).unwrap_or(0.0))
    });
    let extent_m = [0, 1].map(|axis| high[axis] - low[axis]);
    let least_m = FLATTEST * extent_m[0].max(extent_m[1]).max(1.0);
    // Some air around all.
    let size_m = extent_m.map(|m| 1.08 * m.max(least_m));
    let corner_m = [0, 1].map(|axis| f64::midpoint(low[axis], high[axis]) - size_m[axis] / 2.0);
    let scale = WIDTH / size_m[0];
    let height = scale * size_m[1];
    let at =
        |point: &Point3<f64>| [scale * (point.x - corner_m[0]), height - scale * (point.y - corner_m[1])];
    let travel_m = travel_m(&pictures.frames, pictures.bases.len());
    let every = pictures.frames.len().div_ceil(POINTS).max(1);
    let chosen: Vec<usize> = (0..pictures.frames.len()).step_by(every).collect();
    let mut drawing = String::new();
    // The best lies on top.
    for (k, (&run, way)) in runs.iter().zip(ways).enumerate().rev() {
        let points = chosen.iter().map(|&frame| {
            let [x, y] = at(&way[frame]);
            format!("{x:.2},{y:.2}")
        });
        let scans = chosen.iter().map(|&frame| scan_in_words(pictures, run, frame, travel_m[frame]));
        let [x, y] = way.first().map_or([0.0; 2], at);
        // Writing to a string cannot fail.
        let _ = write!(
            drawing,
            "<polyline class=\"s{k}\" points=\"{}\" fill=\"none\" stroke=\"var(--s{k})\" stroke-width=\"1.6\" \
             stroke-linejoin=\"round\" vector-effect=\"non-scaling-stroke\" data-run=\"{}\" data-scans=\"{}\"/>\
             <circle class=\"s{k}\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3\" fill=\"var(--s{k})\"/>",
            points.collect::<Vec<_>>().join(" "),
            escape(names[run]),
            escape(&scans.collect::<Vec<_>>().join(";")),
        );
    }
    let frame = Frame { width: WIDTH, height, units_per_m: scale };
    let svg = frame.svg("Trajectories of all runs from above", &drawing, Some("y"));
    with_data(&svg, "map", &format!("{:.2} {:.2} {scale:.6} {height:.2}", corner_m[0], corner_m[1]))
}

/// A scan and what is known of it there.
fn scan_in_words(pictures: &Pictures, run: usize, frame: usize, way_m: f64) -> String {
    let seen = &pictures.frames[frame];
    let time = match pictures.start_ns {
        Some(_) => format!(", {:.1} s", time_of(seen, pictures.start_ns)),
        None => String::new(),
    };
    let off = match seen.scores[run].rms_m(pictures.scales) {
        Some([_, m]) => format!(", residual {} cm", digits(100.0 * m)),
        None => String::new(),
    };
    // A room needs centimetres.
    let decimals = 2 * metre_decimals(pictures.scales);
    format!("scan {}{time}, {way_m:.decimals$} m travelled{off}", seen.number)
}

fn heights(pictures: &Pictures, runs: &[usize], names: &[&str], ways: &[Vec<Point3<f64>>]) -> Plot {
    let travel_m = travel_m(&pictures.frames, pictures.bases.len());
    let every = pictures.frames.len().div_ceil(POINTS).max(1);
    let series = runs.iter().zip(ways).map(|(&run, way)| {
        let points = travel_m.iter().zip(way).step_by(every);
        Series {
            name: names[run].to_owned(),
            points: points.map(|(&x, point)| Point { x, y: point.z, name: String::new() }).collect(),
            style: Style::Line,
        }
    });
    Plot {
        title: "Height over the path".into(),
        x: Axis { title: "path [m]".into(), log: false },
        y: Axis { title: "height [m]".into(), log: false },
        series: series.collect(),
        ..Plot::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pictures::{FrameScore, Painter, SeenFrame};
    use dmp_reduce::{Basis, Scales};
    use nalgebra::{Isometry3, Translation3, UnitQuaternion};

    /// A way, and the same in another world.
    fn pictures(world: &Isometry3<f64>) -> Pictures {
        let way = |k: usize| {
            let t = k as f64 / 10.0;
            [10.0 * t.cos(), 20.0 * t.sin(), 0.5 * t]
        };
        let frame = |number: usize| SeenFrame {
            number,
            stamp_ns: Some(number as i64 * 100_000_000),
            position_in_world_m: vec![way(number), (world * Point3::from(way(number))).into()],
            scores: vec![FrameScore::default(); 2],
        };
        let bases = vec![Basis::CrossValidated; 2];
        Painter::new(Scales::Drive, (0..60).map(frame).collect(), Some(0), bases, vec![0, 1], 0).finish()
    }

    #[test]
    fn a_run_in_another_world_lies_on_the_first() {
        let turned = UnitQuaternion::from_euler_angles(0.4, -1.0, 2.0);
        let world = Isometry3::from_parts(Translation3::new(100.0, -7.0, 3.0), turned);
        let pictures = pictures(&world);
        let [one, other] = [0, 1].map(|run| laid_onto(&pictures, run, 0));
        let worst_m = one.iter().zip(&other).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        assert!(worst_m < 1e-9, "{worst_m}");
        let drawn = trajectories(&pictures, &[0, 1], &["a", "<b>"], [480.0, 300.0]).concat();
        assert!(drawn.contains("data-run=\"&lt;b&gt;\"") && drawn.contains("scan 7, 0.7 s, "), "{drawn}");
        assert_eq!(drawn.matches("<polyline class=\"s0\"").count(), 2);
    }

    #[test]
    fn the_path_has_centimetres_in_a_room() {
        let mut pictures = pictures(&Isometry3::identity());
        assert_eq!(scan_in_words(&pictures, 0, 7, 12.345), "scan 7, 0.7 s, 12 m travelled");
        pictures.scales = Scales::Room;
        assert_eq!(scan_in_words(&pictures, 0, 7, 12.345), "scan 7, 0.7 s, 12.35 m travelled");
    }

    #[test]
    fn one_scan_is_no_way() {
        let mut pictures = pictures(&Isometry3::identity());
        pictures.frames.truncate(1);
        assert_eq!(trajectories(&pictures, &[0, 1], &["a", "b"], [480.0, 300.0]).concat(), "");
    }
}
