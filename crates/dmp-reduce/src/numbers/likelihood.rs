//! The paper's raw log-likelihood.

/// The raw logarithm of the likelihood of a run's returns, −DMP / (2σ²), without the constant L0 that
/// all runs share (Zhang & Chen 2021, eq. 8–12).
///
/// Uncalibrated: it takes every return as an independent reading with Gaussian noise `sigma_m`, and
/// neighbouring returns and frames are anything but independent. The number orders runs; it must never
/// be turned into a probability.
pub fn log_likelihood_raw(dmp_sum_m2: f64, sigma_m: f64) -> f64 {
    -dmp_sum_m2 / (2.0 * sigma_m * sigma_m)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_smaller_sum_is_the_likelier() {
        assert_eq!(log_likelihood_raw(8.0, 2.0), -1.0);
        // The paper's LLR (eq. 8) is the difference of two.
        assert_eq!(log_likelihood_raw(8.0, 2.0) - log_likelihood_raw(24.0, 2.0), 2.0);
    }
}
