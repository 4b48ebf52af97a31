//! The noise of a depth camera.

/// How a depth camera's noise grows with depth: σ(z) = least + growth · (z − nearest)², metres.
///
/// For the raw log-likelihood alone (Zhang & Chen 2021, eq. 8–12, with an s of each reading).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DepthNoise {
    /// At `nearest_m`, metres.
    pub least_m: f64,
    /// Per square metre of depth beyond it, 1 / metre.
    pub growth_per_m: f64,
    /// Depth at which the noise is least, metres.
    pub nearest_m: f64,
}

impl DepthNoise {
    /// Kinect, axial, surfaces seen squarely: Nguyen, Izadi & Lovell, "Modeling Kinect sensor noise for improved 3D
    /// reconstruction and tracking" (3DIMPVT 2012), σ = 0.0012 + 0.0019 (z − 0.4)².
    pub const KINECT: Self = Self { least_m: 0.0012, growth_per_m: 0.0019, nearest_m: 0.4 };

    /// The same noise at every depth.
    pub const fn constant(sigma_m: f64) -> Self {
        Self { least_m: sigma_m, growth_per_m: 0.0, nearest_m: 0.0 }
    }

    /// σ at a depth, metres.
    #[inline]
    pub fn sigma_m(&self, depth_m: f64) -> f64 {
        let beyond_m = depth_m - self.nearest_m;
        self.least_m + self.growth_per_m * beyond_m * beyond_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_grows_with_depth() {
        assert_eq!(DepthNoise::KINECT.sigma_m(0.4), 0.0012);
        assert!((DepthNoise::KINECT.sigma_m(3.4) - (0.0012 + 0.0019 * 9.0)).abs() < 1e-15);
        assert_eq!(DepthNoise::constant(0.02).sigma_m(7.0), 0.02);
    }
}
