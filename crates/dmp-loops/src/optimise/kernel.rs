//! Robust kernels: what large residuals count for.

/// A robust kernel: what an edge that fits badly counts for less.
///
/// The scale is in standard deviations: a residual as large as it counts for about half to all of its square.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Kernel {
    /// Beyond the scale the cost grows as the residual, not as its square (Huber 1964).
    Huber(f64),
    /// The cost grows as the logarithm of the residual, so that a wrong loop hardly pulls at all.
    Cauchy(f64),
}

impl Kernel {
    /// What a residual of this chi² costs.
    pub(super) fn cost(self, chi2: f64) -> f64 {
        match self {
            Self::Huber(scale) if chi2 > scale * scale => scale * (2.0 * chi2.sqrt() - scale),
            Self::Huber(_) => chi2,
            Self::Cauchy(scale) => scale * scale * libm::log1p(chi2 / (scale * scale)),
        }
    }

    /// How fast the cost grows with chi²: the weight of the edge in the linear system.
    pub(super) fn weight(self, chi2: f64) -> f64 {
        match self {
            Self::Huber(scale) if chi2 > scale * scale => scale / chi2.sqrt(),
            Self::Huber(_) => 1.0,
            Self::Cauchy(scale) => 1.0 / (1.0 + chi2 / (scale * scale)),
        }
    }

    /// How fast the weight grows with chi²; it falls.
    pub(super) fn weight_slope(self, chi2: f64) -> f64 {
        let weight = self.weight(chi2);
        match self {
            Self::Huber(scale) if chi2 > scale * scale => -0.5 * weight / chi2,
            Self::Huber(_) => 0.0,
            Self::Cauchy(scale) => -weight * weight / (scale * scale),
        }
    }

    pub(super) fn scale(self) -> f64 {
        match self {
            Self::Huber(scale) | Self::Cauchy(scale) => scale,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_slopes_of_costs() {
        for kernel in [Kernel::Huber(1.5), Kernel::Cauchy(0.7)] {
            assert_eq!((kernel.cost(0.0), kernel.weight(0.0)), (0.0, 1.0));
            for chi2 in [0.1, 1.0, 2.2, 2.3, 10.0, 1e6] {
                let step = chi2 * 1e-6;
                let slope = (kernel.cost(chi2 + step) - kernel.cost(chi2 - step)) / (2.0 * step);
                assert!((slope - kernel.weight(chi2)).abs() < 1e-6 * slope, "{kernel:?} {chi2}");
                let slope = (kernel.weight(chi2 + step) - kernel.weight(chi2 - step)) / (2.0 * step);
                let wanted = kernel.weight_slope(chi2);
                assert!((slope - wanted).abs() <= 1e-5 * wanted.abs(), "{kernel:?} {chi2}");
            }
        }
        assert!(Kernel::Cauchy(1.0).weight(1e4) < Kernel::Huber(1.0).weight(1e4));
    }
}
