//! Samples points evenly on the triangles of a mesh.

use crate::MapError;

/// Fractions of 2⁶⁴: the steps of the R2 sequence, 1/g and 1/g² with g³ = g + 1 (Roberts 2018, "The
/// unreasonable effectiveness of quasirandom sequences").
const STEPS: [u64; 2] = [0xC13F_A9A9_02A6_328F, 0x91E1_0DA5_C79E_7B1D];

/// No surface of a town has a triangle with a longer edge: a vertex or the unit is wrong, metres.
const LONGEST_EDGE_M: f64 = 3e3;
/// Larger triangles are sampled in parts, so that consecutive samples are near each other. Otherwise a map that exceeds
/// its memory would spill each of its tiles again and again.
const PART_SAMPLES: f64 = 65_536.0;

type Triangle = [[f64; 3]; 3];

/// Samples triangles evenly by area: one sample per `spacing_m`² of the area, accumulated in the order of the
/// triangles. So many small triangles get as many samples as a large one, and a mesh always gives the same samples.
#[derive(Debug)]
pub struct TriangleSampler {
    spacing_m: f64,
    max_samples: f64,
    /// Area since the last sample, in samples. Half a sample's area precedes the first.
    waiting: f64,
    next: u64,
    triangles: u64,
    area_m2: f64,
}

impl TriangleSampler {
    /// A sampler of at most `max_samples` in total.
    pub fn new(spacing_m: f64, max_samples: u64) -> Self {
        let max_samples = max_samples as f64;
        Self { spacing_m, max_samples, waiting: 0.5, next: 0, triangles: 0, area_m2: 0.0 }
    }

    /// The area of all triangles so far, square metres.
    pub fn area_m2(&self) -> f64 {
        self.area_m2
    }

    /// Calls `each` with the samples of the next triangle, whose corners are finite: positions on it, metres.
    ///
    /// # Errors
    /// When an edge is longer than that of any surface, or the total area is too large for the spacing, before the
    /// first sample of this triangle; and the first error of `each`.
    pub fn sample<E: From<MapError>>(
        &mut self,
        triangle: &Triangle,
        mut each: impl FnMut([f64; 3]) -> Result<(), E>,
    ) -> Result<(), E> {
        let (_, edge_m) = longest_edge(triangle);
        if edge_m.is_nan() || edge_m > LONGEST_EDGE_M {
            return Err(MapError::TriangleTooLong { triangle: self.triangles, edge_m }.into());
        }
        let area_m2 = area_m2(triangle);
        let samples = area_m2 / (self.spacing_m * self.spacing_m);
        self.area_m2 += area_m2;
        if self.next as f64 + self.waiting + samples > self.max_samples {
            let (triangle, spacing_m) = (self.triangles, self.spacing_m);
            return Err(MapError::TooManySamples { triangle, area_m2: self.area_m2, spacing_m }.into());
        }
        self.triangles += 1;
        self.sample_part(triangle, samples, &mut each)
    }

    /// Samples a triangle with the area of this many samples; large ones are halved recursively.
    fn sample_part<E>(
        &mut self,
        triangle: &Triangle,
        samples: f64,
        each: &mut impl FnMut([f64; 3]) -> Result<(), E>,
    ) -> Result<(), E> {
        if samples > PART_SAMPLES {
            let (first, _) = longest_edge(triangle);
            let [a, b, c] = [0, 1, 2].map(|k| triangle[(first + k) % 3]);
            let middle = std::array::from_fn(|k| 0.5 * (a[k] + b[k]));
            self.sample_part(&[a, middle, c], 0.5 * samples, each)?;
            return self.sample_part(&[middle, b, c], 0.5 * samples, each);
        }
        self.waiting += samples;
        while self.waiting >= 1.0 {
            self.waiting -= 1.0;
            let fraction = |step: u64| self.next.wrapping_mul(step) as f64 / 18_446_744_073_709_551_616.0;
            let [mut u, mut v] = STEPS.map(fraction);
            // The other half of the parallelogram, reflected into the triangle.
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

/// The longest edge's first corner and its length in metres; NaN if any edge's is.
fn longest_edge(triangle: &Triangle) -> (usize, f64) {
    let length_m = |k: usize| {
        let [x, y, z] = difference(triangle[(k + 1) % 3], triangle[k]);
        (x * x + y * y + z * z).sqrt()
    };
    (1..3).map(|k| (k, length_m(k))).fold((0, length_m(0)), |longest, edge| {
        if edge.1 > longest.1 || edge.1.is_nan() { edge } else { longest }
    })
}

/// Square metres.
fn area_m2(&[a, b, c]: &Triangle) -> f64 {
    let (u, v) = (difference(b, a), difference(c, a));
    let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    0.5 * normal.iter().map(|n| n * n).sum::<f64>().sqrt()
}

fn difference(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| a[k] - b[k])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn samples_of(spacing_m: f64, triangles: &[Triangle]) -> Vec<[f64; 3]> {
        let (mut sampler, mut samples) = (TriangleSampler::new(spacing_m, 1 << 20), Vec::new());
        for triangle in triangles {
            let put = |sample| {
                samples.push(sample);
                Ok::<(), MapError>(())
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
        let inside = |s: &[f64; 3]| s[0] >= 1.0 && s[1] >= 0.0 && s[0] + s[1] <= 5.0 + 1e-12 && s[2] == 2.0;
        assert!(samples.iter().all(inside));
        // The half nearest to the corner has a quarter of the area.
        let near = samples.iter().filter(|s| s[0] - 1.0 + s[1] < 2.0).count();
        assert!((790..=810).contains(&near), "{near}");
    }

    #[test]
    fn every_square_of_a_large_triangle_gets_its_share() {
        // Also with a triangle a hundred times as long as it is wide.
        for (length_m, width_m) in [(20.0, 20.0), (200.0, 2.0)] {
            let triangle = [[0.0, 0.0, 0.0], [length_m, 0.0, 0.0], [0.0, width_m, 0.0]];
            let samples = samples_of(0.04, &[triangle]);
            let mut fewest = usize::MAX;
            for column in 0..(0.4 * length_m / 0.2) as i32 {
                for row in 0..(0.4 * width_m / 0.2) as i32 {
                    let (x, y) = (0.2 * f64::from(column), 0.2 * f64::from(row));
                    let inside = |s: &&[f64; 3]| s[0] >= x && s[0] < x + 0.2 && s[1] >= y && s[1] < y + 0.2;
                    fewest = fewest.min(samples.iter().filter(inside).count());
                }
            }
            // Three make a surfel.
            assert!(fewest >= 9, "{fewest} of 25 on average");
        }
    }

    #[test]
    fn samples_that_follow_each_other_lie_near_each_other() {
        let triangle = [[0.0, 0.0, 1.0], [300.0, 0.0, 1.0], [0.0, 300.0, 1.0]];
        let samples = samples_of(0.25, &[triangle]);
        assert_eq!(samples.len(), 720_000);
        let is_wide = |chunk: &&[[f64; 3]]| {
            [0, 1].into_iter().any(|axis| {
                let of = |s: &[f64; 3]| s[axis];
                let most = chunk.iter().map(of).fold(f64::MIN, f64::max);
                most - chunk.iter().map(of).fold(f64::MAX, f64::min) > 100.0
            })
        };
        // Samples that continue in the next part.
        let wide = samples.chunks(4096).filter(is_wide).count();
        assert!(wide <= 720_000 / 32_768, "{wide}");
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
        let mut sampler = TriangleSampler::new(0.001, 1 << 31);
        let none = |_| Ok::<(), MapError>(());
        sampler.sample(&[[0.0; 3], [0.01, 0.0, 0.0], [0.0, 0.01, 0.0]], none).unwrap();
        let large = [[0.0, 0.0, 0.0], [100.0, 0.0, 0.0], [0.0, 100.0, 0.0]];
        let error = sampler.sample(&large, none).unwrap_err().to_string();
        assert!(error.contains("triangle 1") && error.contains("larger spacing"), "{error}");
        // Where one vertex is wrong.
        for far_m in [3.1e3, 5e7, f64::INFINITY] {
            let huge = [[0.0, 0.0, 0.0], [far_m, 0.0, 0.0], [0.0, 1.0, 0.0]];
            let error = sampler.sample(&huge, none).unwrap_err().to_string();
            assert!(error.contains("triangle 1") && error.contains("is a vertex wrong"), "{error}");
        }
    }
}
