//! Residuals over time and over the way.

use dmp_reduce::Basis;

use super::painter::Pictures;
use super::seen::{FrameScore, SeenFrame, judged_by_m};
use super::worst::travel_m;
use crate::plot::{Axis, Plot, Point, Series, Style};

/// Pieces that the time of a log is cut into.
const PIECES: usize = 240;

/// Seconds after the first scan of the log, whose stamp is `start_ns`, or the number of the scan in a log without stamps.
pub(crate) fn time_of(frame: &SeenFrame, start_ns: Option<i64>) -> f64 {
    match (start_ns, frame.stamp_ns) {
        (Some(start_ns), Some(ns)) => ns.saturating_sub(start_ns) as f64 / 1e9,
        _ => frame.number as f64,
    }
}

/// The score at the coarser scale (2 m on a drive) over time, a line for each of the runs.
pub(crate) fn over_time(pictures: &Pictures, runs: &[(usize, &str)], score: Basis) -> Plot {
    let start_ns = pictures.start_ns;
    let times: Vec<f64> = pictures.frames.iter().map(|frame| time_of(frame, start_ns)).collect();
    let title = if start_ns.is_some() { "seconds after the first scan" } else { "scan" };
    over(pictures, &times, runs, ["time", title], score)
}

/// The same over the way, metres.
pub(crate) fn over_way(pictures: &Pictures, runs: &[(usize, &str)], score: Basis) -> Plot {
    let way_m = travel_m(&pictures.frames, pictures.bases.len());
    over(pictures, &way_m, runs, ["the path", "path [m]"], score)
}

/// The score at the coarser scale over what rises from scan to scan.
fn over(
    Pictures { frames, scales, .. }: &Pictures,
    times: &[f64],
    runs: &[(usize, &str)],
    [what, axis]: [&str; 2],
    score: Basis,
) -> Plot {
    let scale_m = judged_by_m(*scales)[1];
    let (first, last) =
        times.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), &t| (a.min(t), b.max(t)));
    let pieces = PIECES.min(frames.len()).max(1);
    let piece_of = |time: f64| {
        let share = if last > first { (time - first) / (last - first) } else { 0.0 };
        ((share * pieces as f64) as usize).min(pieces - 1)
    };
    let series = runs.iter().map(|&(run, name)| {
        let mut sums = vec![FrameScore::default(); pieces];
        let mut has_scans = vec![false; pieces];
        for (frame, time) in frames.iter().zip(times) {
            let piece = piece_of(*time);
            sums[piece].add(&frame.scores[run]);
            has_scans[piece] = true;
        }
        let point = |(piece, sum): (usize, &FrameScore)| Point {
            x: first + (piece as f64 + 0.5) / pieces as f64 * (last - first),
            y: sum.rms_m(*scales).map_or(f64::NAN, |[_, rms_m]| rms_m),
            name: String::new(),
        };
        Series {
            name: name.to_owned(),
            // A gap says that nothing is predicted there, and not that the sensor went by between two scans.
            points: sums.iter().enumerate().filter(|(piece, _)| has_scans[*piece]).map(point).collect(),
            style: Style::Line,
        }
    });
    Plot {
        title: format!("{score} at {scale_m} m over {what}"),
        x: Axis { title: axis.to_owned(), log: false },
        y: Axis { title: format!("{score} {scale_m} m [m]"), log: false },
        series: series.collect(),
        ..Plot::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pictures::painter::Painter;
    use dmp_reduce::Scales;

    fn frame(number: usize, stamp_ns: Option<i64>, rms_m: f64) -> SeenFrame {
        let score = FrameScore {
            predicted: u64::from(rms_m > 0.0),
            parts: [0.0, rms_m * rms_m / 4.0],
            ..FrameScore::default()
        };
        SeenFrame { number, stamp_ns, position_in_world_m: vec![[0.0; 3]], scores: vec![score] }
    }

    #[test]
    fn where_no_scan_is_the_line_goes_on() {
        let mut frames: Vec<_> = (0..4).map(|k| frame(k, None, if k == 2 { 0.0 } else { 1.0 })).collect();
        for (frame, way_m) in frames.iter_mut().zip([0.0, 1.0, 55.0, 200.0]) {
            frame.position_in_world_m = vec![[way_m, 0.0, 0.0]];
        }
        let pictures =
            Painter::new(Scales::Drive, frames, None, vec![Basis::CrossValidated], vec![0], 0).finish();
        let plot = over_way(&pictures, &[(0, "a")], Basis::CrossValidated);
        let heights: Vec<f64> = plot.series[0].points.iter().map(|point| point.y).collect();
        assert!(matches!(heights[..], [a, b, c] if a == 1.0 && b.is_nan() && c == 1.0), "{heights:?}");
    }

    #[test]
    fn time_counts_from_the_first_scan() {
        let frames: Vec<_> =
            (0..5).map(|k| frame(10 + k, Some(7_000_000_000 + 500_000_000 * k as i64), 1.0)).collect();
        let start_ns = Some(6_000_000_000);
        assert_eq!(time_of(&frames[4], start_ns), 3.0);
        let over_time = |frames, start_ns| {
            let bases = vec![Basis::CrossValidated];
            let pictures = Painter::new(Scales::Drive, frames, start_ns, bases, vec![0], 0).finish();
            over_time(&pictures, &[(0, "a")], Basis::CrossValidated)
        };
        let plot = over_time(frames, start_ns);
        assert_eq!(plot.series[0].points.len(), 5);
        assert!(plot.series[0].points.iter().all(|point| (point.y - 1.0).abs() < 1e-12));
        let frames: Vec<_> = (0..3).map(|k| frame(4 * k, None, if k == 1 { 0.0 } else { 2.0 })).collect();
        assert_eq!(time_of(&frames[2], None), 8.0);
        let plot = over_time(frames, None);
        assert!(plot.series[0].points[1].y.is_nan(), "nothing was predicted");
        assert!(over_time(Vec::new(), None).series[0].points.is_empty());
    }
}
