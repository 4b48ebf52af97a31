//! Pairs of runs, each with the better run first: for tables and pages alike.

use dmp_report::{PairReport, Report, ScaleReport};

/// With more runs than this, only neighbours in the order and pairs with the best are listed.
const ALL_PAIRS_UP_TO: usize = 5;

/// A pair with the better run first, be it only on the whole; where nothing is decided, the run that stands higher in the
/// order.
#[derive(Debug, Clone, Copy)]
pub struct OrderedPair<'a> {
    /// The pair.
    pub pair: &'a PairReport,
    /// The name of the run that stands first.
    pub first: &'a str,
    /// The name of the other.
    pub second: &'a str,
}

impl<'a> OrderedPair<'a> {
    /// The pair of two runs, of which `high` stands above `low` in the order; `None` where they were not compared.
    pub fn of(report: &'a Report, high: &'a str, low: &'a str) -> Option<Self> {
        let pair = report.pair(high, low)?;
        // Around a cycle the better run may stand below.
        let (first, second) = if pair.verdict.ahead() == Some(low) { (low, high) } else { (high, low) };
        Some(Self { pair, first, second })
    }

    /// Mean squares of the first and the second run at a scale, m².
    pub fn means_m2(&self, scale: &ScaleReport) -> [Option<f64>; 2] {
        let means_m2 = [scale.mean_a_m2, scale.mean_b_m2];
        if self.is_turned() { [means_m2[1], means_m2[0]] } else { means_m2 }
    }

    /// First minus second, m².
    pub fn difference_m2(&self, scale: &ScaleReport) -> Option<f64> {
        let sign = if self.is_turned() { -1.0 } else { 1.0 };
        scale.difference_m2.map(|difference_m2| sign * difference_m2)
    }

    /// The interval of first minus second, m².
    pub fn interval_m2(&self, scale: &ScaleReport) -> Option<[f64; 2]> {
        scale.interval_m2.map(|[low, high]| if self.is_turned() { [-high, -low] } else { [low, high] })
    }

    /// How much larger the root mean square of the second run is at a scale, metres, and the interval of that: of the
    /// difference of the squares, from the first run's own.
    pub fn rms_behind_m(&self, scale: &ScaleReport) -> Option<(f64, Option<[f64; 2]>)> {
        let own_m2 = self.means_m2(scale)[0]?;
        let behind_m = |less_m2: f64| (own_m2 - less_m2).max(0.0).sqrt() - own_m2.sqrt();
        let interval_m = self.interval_m2(scale).map(|[low, high]| [behind_m(high), behind_m(low)]);
        Some((behind_m(self.difference_m2(scale)?), interval_m))
    }

    fn is_turned(&self) -> bool {
        self.first != self.pair.a
    }
}

/// The pairs that matter, in the order of the runs.
pub fn main_pairs(report: &Report) -> Vec<OrderedPair<'_>> {
    let is_short = report.order.len() <= ALL_PAIRS_UP_TO;
    in_order(report, |i, j| is_short || i == 0 || j == i + 1)
}

/// Every pair, in the order of the runs.
pub fn every_pair(report: &Report) -> Vec<OrderedPair<'_>> {
    in_order(report, |_, _| true)
}

/// The pairs of runs at such places of the order.
fn in_order(report: &Report, is_listed: impl Fn(usize, usize) -> bool) -> Vec<OrderedPair<'_>> {
    let mut pairs = Vec::new();
    for (i, high) in report.order.iter().enumerate() {
        let below = report.order.iter().enumerate().skip(i + 1).filter(|(j, _)| is_listed(i, *j));
        pairs.extend(below.filter_map(|(_, low)| OrderedPair::of(report, high, low)));
    }
    pairs
}
