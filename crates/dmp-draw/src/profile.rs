//! Residuals over time, and how large they are.

use dmp::Basis;

use crate::plot::{Axis, Plot, Point, Series, Style};
use crate::seen::{FrameScore, SampledReturn, SeenFrame};
use crate::worst::travel_m;

/// Pieces that the time of a log is cut into.
const PIECES: usize = 240;
/// The histogram goes so far to both sides, metres, in so many bins.
const WIDEST_M: f64 = 2.0;
const BINS: usize = 80;

/// Seconds after the first scan of the log, whose stamp is `start_ns`, or the number of the scan in a log without stamps.
pub(crate) fn time_of(frame: &SeenFrame, start_ns: Option<i64>) -> f64 {
    match (start_ns, frame.stamp_ns) {
        (Some(start_ns), Some(ns)) => ns.saturating_sub(start_ns) as f64 / 1e9,
        _ => frame.number as f64,
    }
}

/// The score at 2 m over time, a line for each of the runs.
pub(crate) fn over_time(
    frames: &[SeenFrame],
    start_ns: Option<i64>,
    runs: &[(usize, &str)],
    score: Basis,
) -> Plot {
    let times: Vec<f64> = frames.iter().map(|frame| time_of(frame, start_ns)).collect();
    let title = if start_ns.is_some() { "seconds after the first scan" } else { "scan" };
    over(frames, &times, runs, [&format!("{score} at 2 m over time"), title], score)
}

/// The same over the way, metres.
pub(crate) fn over_way(frames: &[SeenFrame], of_all: usize, runs: &[(usize, &str)], score: Basis) -> Plot {
    let way_m = travel_m(frames, of_all);
    over(frames, &way_m, runs, [&format!("{score} at 2 m over the way"), "way [m]"], score)
}

/// The score at 2 m over what rises from scan to scan.
fn over(
    frames: &[SeenFrame],
    times: &[f64],
    runs: &[(usize, &str)],
    [title, axis]: [&str; 2],
    score: Basis,
) -> Plot {
    let (first, last) =
        times.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), &t| (a.min(t), b.max(t)));
    let pieces = PIECES.min(frames.len()).max(1);
    let piece_of = |time: f64| {
        let share = if last > first { (time - first) / (last - first) } else { 0.0 };
        ((share * pieces as f64) as usize).min(pieces - 1)
    };
    let series = runs.iter().map(|&(run, name)| {
        let mut sums = vec![FrameScore::default(); pieces];
        for (frame, time) in frames.iter().zip(times) {
            sums[piece_of(*time)].add(&frame.scores[run]);
        }
        let point = |(piece, sum): (usize, &FrameScore)| Point {
            x: first + (piece as f64 + 0.5) / pieces as f64 * (last - first),
            y: sum.rms_m(1).unwrap_or(f64::NAN),
            name: String::new(),
        };
        Series {
            name: name.to_owned(),
            points: sums.iter().enumerate().map(point).collect(),
            style: Style::Line,
        }
    });
    Plot {
        title: title.to_owned(),
        x: Axis { title: axis.to_owned(), log: false },
        y: Axis { title: format!("{score} 2 m [m]"), log: false },
        series: series.collect(),
        ..Plot::default()
    }
}

/// How many returns have which residual.
#[derive(Debug, Clone)]
pub(crate) struct Histogram {
    bins: [u64; BINS],
    predicted: u64,
}

impl Histogram {
    pub(crate) fn new() -> Self {
        Self { bins: [0; BINS], predicted: 0 }
    }

    pub(crate) fn add(&mut self, sampled: &SampledReturn) {
        let Some(residual_m) = sampled.residual_m else { return };
        self.predicted += 1;
        let bin = ((f64::from(residual_m) + WIDEST_M) / (2.0 * WIDEST_M) * BINS as f64).floor();
        if (0.0..BINS as f64).contains(&bin) {
            self.bins[bin as usize] += 1;
        }
    }

    /// Share of the returns in every bin, at its middle.
    fn points(&self) -> Vec<Point> {
        let width_m = 2.0 * WIDEST_M / BINS as f64;
        let point = |(bin, count): (usize, &u64)| Point {
            x: (bin as f64 + 0.5) * width_m - WIDEST_M,
            // Where there are none, a logarithmic axis has no place for them.
            y: *count as f64 / self.predicted.max(1) as f64 * 100.0,
            name: String::new(),
        };
        self.bins.iter().enumerate().map(point).collect()
    }
}

/// The histograms of some runs.
pub(crate) fn by_size(histograms: &[Histogram], runs: &[(usize, &str)]) -> Plot {
    let series = runs.iter().map(|&(run, name)| Series {
        name: name.to_owned(),
        points: histograms[run].points(),
        style: Style::Line,
    });
    Plot {
        title: "How many returns have which residual".into(),
        x: Axis { title: "measured minus predicted range [m]".into(), log: false },
        y: Axis { title: "% of returns in 5 cm".into(), log: true },
        series: series.collect(),
        ..Plot::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(number: usize, stamp_ns: Option<i64>, rms_m: f64) -> SeenFrame {
        let score = FrameScore {
            predicted: u64::from(rms_m > 0.0),
            squares_m2: [0.0, rms_m * rms_m],
            ..FrameScore::default()
        };
        SeenFrame { number, stamp_ns, position_in_world_m: vec![[0.0; 3]], scores: vec![score] }
    }

    #[test]
    fn time_counts_from_the_first_scan() {
        let frames: Vec<_> =
            (0..5).map(|k| frame(10 + k, Some(7_000_000_000 + 500_000_000 * k as i64), 1.0)).collect();
        let start_ns = Some(6_000_000_000);
        assert_eq!(time_of(&frames[4], start_ns), 3.0);
        let plot = over_time(&frames, start_ns, &[(0, "a")], Basis::CrossValidated);
        assert_eq!(plot.series[0].points.len(), 5);
        assert!(plot.series[0].points.iter().all(|point| (point.y - 1.0).abs() < 1e-12));
        let frames: Vec<_> = (0..3).map(|k| frame(4 * k, None, if k == 1 { 0.0 } else { 2.0 })).collect();
        assert_eq!(time_of(&frames[2], None), 8.0);
        let plot = over_time(&frames, None, &[(0, "a")], Basis::CrossValidated);
        assert!(plot.series[0].points[1].y.is_nan(), "nothing was predicted");
        assert!(over_time(&[], None, &[(0, "a")], Basis::CrossValidated).series[0].points[0].y.is_nan());
    }

    #[test]
    fn shares_of_the_histogram_add_up() {
        let mut histogram = Histogram::new();
        for residual_m in [0.01, 0.02, -1.99, 30.0] {
            histogram.add(&SampledReturn {
                from_sensor_m: [0.0; 3],
                direction: [0.0, 0.6, -0.8],
                residual_m: Some(residual_m),
                revisited: false,
            });
        }
        histogram.add(&SampledReturn {
            from_sensor_m: [0.0; 3],
            direction: [0.0, 0.6, -0.8],
            residual_m: None,
            revisited: false,
        });
        let points = histogram.points();
        assert_eq!((points[40].y, points[0].y), (50.0, 25.0));
        assert!((points[40].x - 0.025).abs() < 1e-9);
        assert_eq!(points.iter().map(|point| point.y).sum::<f64>(), 75.0, "one lies beyond");
    }
}
