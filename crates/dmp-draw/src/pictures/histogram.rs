//! How large residuals are.

use dmp_reduce::Scales;

use super::seen::{SampledReturn, judged_by_m};
use crate::plot::{Axis, Plot, Point, Series, Style};

/// The histogram goes to the coarser scale on both sides, in so many bins.
const BINS: usize = 80;

/// How many returns have which residual.
#[derive(Debug, Clone)]
pub(crate) struct Histogram {
    widest_m: f64,
    bins: [u64; BINS],
    predicted: u64,
}

impl Histogram {
    pub(crate) fn new(scales: Scales) -> Self {
        Self { widest_m: judged_by_m(scales)[1], bins: [0; BINS], predicted: 0 }
    }

    pub(crate) fn add(&mut self, sampled: &SampledReturn) {
        let Some(residual_m) = sampled.residual_m else { return };
        self.predicted += 1;
        let bin = ((f64::from(residual_m) + self.widest_m) / (2.0 * self.widest_m) * BINS as f64).floor();
        if (0.0..BINS as f64).contains(&bin) {
            self.bins[bin as usize] += 1;
        }
    }

    fn bin_m(&self) -> f64 {
        2.0 * self.widest_m / BINS as f64
    }

    /// Share of the returns in every bin, at its middle.
    fn points(&self) -> Vec<Point> {
        let width_m = self.bin_m();
        let point = |(bin, count): (usize, &u64)| Point {
            x: (bin as f64 + 0.5) * width_m - self.widest_m,
            // Where there are none, a logarithmic axis has no place for them.
            y: *count as f64 / self.predicted.max(1) as f64 * 100.0,
            name: String::new(),
        };
        self.bins.iter().enumerate().map(point).collect()
    }
}

/// The histograms of some runs.
pub(crate) fn by_size(histograms: &[Histogram], runs: &[(usize, &str)]) -> Plot {
    let bin_m = histograms.first().map_or(0.0, Histogram::bin_m);
    let series = runs.iter().map(|&(run, name)| Series {
        name: name.to_owned(),
        points: histograms[run].points(),
        style: Style::Line,
    });
    Plot {
        title: "How many returns have which residual".into(),
        x: Axis { title: "measured minus predicted range [m]".into(), log: false },
        y: Axis { title: format!("% of returns in {} cm", (1e3 * bin_m).round() / 10.0), log: true },
        series: series.collect(),
        ..Plot::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_of_the_histogram_add_up() {
        let mut histogram = Histogram::new(Scales::Drive);
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
