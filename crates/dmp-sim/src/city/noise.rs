//! Normal numbers for every return, at the price of a table.

/// Steps of the table.
const STEPS: usize = 1024;

/// The quantiles of the normal distribution at even steps, with straight lines between them.
#[derive(Debug, Clone)]
pub(crate) struct Normal {
    quantiles: Vec<f64>,
}

impl Normal {
    pub(crate) fn new() -> Self {
        // The outermost steps end where the mean of their line is the mean of the distribution there.
        let at = |step: usize| quantile((step as f64).clamp(0.12, STEPS as f64 - 0.12) / STEPS as f64);
        Self { quantiles: (0..=STEPS).map(at).collect() }
    }

    /// A normal number of the upper 40 bits of a random word.
    #[inline]
    pub(crate) fn of(&self, word: u64) -> f64 {
        let step = (word >> 54) as usize;
        let share = ((word >> 24) & 0x3fff_ffff) as f64 * (1.0 / (1u64 << 30) as f64);
        let (low, high) = (self.quantiles[step], self.quantiles[step + 1]);
        low + (high - low) * share
    }
}

/// The number that a share of all normal numbers lie below, by bisection.
fn quantile(share: f64) -> f64 {
    let (mut low, mut high) = (-9.0, 9.0);
    for _ in 0..60 {
        let middle = f64::midpoint(low, high);
        let below = 0.5 * libm::erfc(-middle * std::f64::consts::FRAC_1_SQRT_2);
        (low, high) = if below < share { (middle, high) } else { (low, middle) };
    }
    f64::midpoint(low, high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    #[test]
    fn the_numbers_are_normal() {
        let (normal, mut random) = (Normal::new(), Random::new(2, &[]));
        let draws: Vec<f64> = (0..400_000).map(|_| normal.of(random.word())).collect();
        let moment = |k: u32| {
            draws.iter().map(|x| (0..k).map(|_| x).product::<f64>()).sum::<f64>() / draws.len() as f64
        };
        assert!(moment(1).abs() < 0.01, "{}", moment(1));
        assert!((moment(2) - 1.0).abs() < 0.01, "{}", moment(2));
        assert!((moment(4) - 3.0).abs() < 0.1, "{}", moment(4));
        let beyond = draws.iter().filter(|x| x.abs() > 1.959_964).count() as f64 / draws.len() as f64;
        assert!((beyond - 0.05).abs() < 0.002, "{beyond}");
    }
}
