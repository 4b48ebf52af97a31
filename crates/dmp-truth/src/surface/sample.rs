use super::triangle::area_m2;
use super::{SurfaceError, Triangle};

/// Most samples of a mesh.
const MAX_SAMPLES: f64 = 4_294_967_296.0;
/// Fractions of 2⁶⁴: the steps of the R2 sequence, 1/g and 1/g² with g³ = g + 1 (Roberts 2018, "The
/// unreasonable effectiveness of quasirandom sequences").
const STEPS: [u64; 2] = [0xC13F_A9A9_02A6_328F, 0x91E1_0DA5_C79E_7B1D];

/// Samples triangles evenly by area: one sample each `spacing_m`² of the area added up in the order of the
/// triangles. So small triangles together get what a large one gets, and a mesh always gives the same.
#[derive(Debug)]
pub(super) struct Sampler {
    spacing_m: f64,
    /// Area since the last sample, in samples. Half a sample's area goes ahead of the first.
    waiting: f64,
    next: u64,
    pub(super) area_m2: f64,
}

impl Sampler {
    pub(super) fn new(spacing_m: f64) -> Self {
        Self { spacing_m, waiting: 0.5, next: 0, area_m2: 0.0 }
    }

    pub(super) fn sample(
        &mut self,
        triangle: &Triangle,
        mut each: impl FnMut([f64; 3]) -> Result<(), SurfaceError>,
    ) -> Result<(), SurfaceError> {
        let area_m2 = area_m2(triangle);
        self.area_m2 += area_m2;
        self.waiting += area_m2 / (self.spacing_m * self.spacing_m);
        if self.next as f64 + self.waiting > MAX_SAMPLES {
            return Err(SurfaceError::TooManySamples { area_m2: self.area_m2, spacing_m: self.spacing_m });
        }
        while self.waiting >= 1.0 {
            self.waiting -= 1.0;
            let fraction = |step: u64| self.next.wrapping_mul(step) as f64 / 18_446_744_073_709_551_616.0;
            let [mut u, mut v] = STEPS.map(fraction);
            // The other half of the parallelogram, turned into the triangle.
            if u + v > 1.0 {
                (u, v) = (1.0 - u, 1.0 - v);
            }
            self.next += 1;
            let [a, b, c] = triangle;
            each(std::array::from_fn(|k| a[k] + u * (b[k] - a[k]) + v * (c[k] - a[k])))?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::triangle::squared_distance;

    fn samples_of(spacing_m: f64, triangles: &[Triangle]) -> Vec<[f64; 3]> {
        let (mut sampler, mut samples) = (Sampler::new(spacing_m), Vec::new());
        for triangle in triangles {
            let put = |sample| {
                samples.push(sample);
                Ok(())
            };
            sampler.sample(triangle, put).unwrap();
        }
        samples
    }

    #[test]
    fn samples_lie_on_the_triangle_evenly() {
        let triangle = [[1.0, 0.0, 2.0], [5.0, 0.0, 2.0], [1.0, 4.0, 2.0]];
        let samples = samples_of(0.05, &[triangle]);
        assert_eq!(samples.len(), 3200);
        assert!(samples.iter().all(|s| squared_distance(*s, &triangle) < 1e-24));
        // The half nearest to the corner has a quarter of the area.
        let near = samples.iter().filter(|s| s[0] - 1.0 + s[1] < 2.0).count();
        assert!((790..=810).contains(&near), "{near}");
    }

    #[test]
    fn many_small_triangles_get_as_many_as_a_large_one() {
        let strip = |k: i32| {
            let x = f64::from(k) * 0.01;
            [[x, 0.0, 0.0], [x + 0.01, 0.0, 0.0], [x, 0.02, 0.0]]
        };
        let triangles: Vec<Triangle> = (0..10_000).map(strip).collect();
        // An area of 1 m².
        assert_eq!(samples_of(0.1, &triangles).len(), 100);
        assert!(samples_of(10.0, &triangles).is_empty());
    }

    #[test]
    fn an_area_without_end_is_refused() {
        let mut sampler = Sampler::new(0.001);
        let huge = [[0.0, 0.0, 0.0], [5e7, 0.0, 0.0], [0.0, 5e7, 0.0]];
        let error = sampler.sample(&huge, |_| Ok(())).unwrap_err();
        assert!(error.to_string().contains("larger spacing"), "{error}");
    }
}
