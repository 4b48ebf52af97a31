//! Which pairs of runs are told of a report, and from whose side: for tables and pages alike.

use dmp::{PairReport, Report, ScaleReport};

/// With more runs than this, only neighbours in the order and pairs with the best are told.
const ALL_PAIRS_UP_TO: usize = 5;

/// A pair the way it is told: the better run first, be it only on the whole; where nothing is decided, the run that
/// stands higher in the order.
#[derive(Debug, Clone, Copy)]
pub struct ToldPair<'a> {
    /// The pair.
    pub pair: &'a PairReport,
    /// The name of the run that stands first.
    pub first: &'a str,
    /// The name of the other.
    pub second: &'a str,
}

impl ToldPair<'_> {
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

    fn is_turned(&self) -> bool {
        self.first != self.pair.a
    }
}

/// The pairs that matter, in the order of the runs.
pub fn told_pairs(report: &Report) -> Vec<ToldPair<'_>> {
    let order = &report.order;
    let mut told = Vec::new();
    for (i, high) in order.iter().enumerate() {
        for (j, low) in order.iter().enumerate().skip(i + 1) {
            if order.len() > ALL_PAIRS_UP_TO && i > 0 && j > i + 1 {
                continue;
            }
            if let Some(pair) = report.pair(high, low) {
                // Around a cycle the better run may stand below.
                let turned = pair.verdict.ahead() == Some(low);
                let (first, second) = if turned { (low, high) } else { (high, low) };
                told.push(ToldPair { pair, first, second });
            }
        }
    }
    told
}
