//! Sums up errors: mean, median, root mean square and the like.

use super::sum::sum;

/// Statistics of a list of errors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Statistics {
    /// Largest.
    pub max: f64,
    /// Mean.
    pub mean: f64,
    /// Median; between the two in the middle where the number is even.
    pub median: f64,
    /// Smallest.
    pub min: f64,
    /// Root of the mean square.
    pub rmse: f64,
    /// Sum of squares.
    pub sse: f64,
    /// Standard deviation, divided by n.
    pub std: f64,
}

impl Statistics {
    /// Of these values; `None` of none.
    pub fn of(values: &[f64]) -> Option<Self> {
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        let (min, max) = (*sorted.first()?, *sorted.last()?);
        let count = values.len() as f64;
        let mean = sum(values.iter().copied()) / count;
        let sse = sum(values.iter().map(|value| value * value));
        let variance = sum(values.iter().map(|value| (value - mean) * (value - mean))) / count;
        let (half, upper) = (sorted.len() / 2, sorted[sorted.len() / 2]);
        let median = if sorted.len() % 2 == 1 { upper } else { f64::midpoint(sorted[half - 1], upper) };
        Some(Self { max, mean, median, min, rmse: (sse / count).sqrt(), sse, std: variance.sqrt() })
    }

    /// Names and values in the order of the alphabet.
    pub fn named(&self) -> [(&'static str, f64); 7] {
        [
            ("max", self.max),
            ("mean", self.mean),
            ("median", self.median),
            ("min", self.min),
            ("rmse", self.rmse),
            ("sse", self.sse),
            ("std", self.std),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statistics_by_hand() {
        let found = Statistics::of(&[4.0, 1.0, 2.0, 5.0]).unwrap();
        assert_eq!((found.max, found.mean, found.median, found.min), (5.0, 3.0, 3.0, 1.0));
        assert_eq!((found.rmse, found.sse, found.std), (11.5_f64.sqrt(), 46.0, 2.5_f64.sqrt()));
        assert_eq!(Statistics::of(&[7.0, 1.0, 2.0]).unwrap().median, 2.0);
        assert_eq!(Statistics::of(&[]), None);
    }
}
