//! A map in three dimensions: a sample of its surfels, lit from above, and of the returns that it misses.

use dmp_reduce::Scales;

use super::closeup::DiscInWorld;
use super::seen::SampledReturn;
use crate::colour::{MISSED, Rgb, missed};
use crate::image::Image;

/// Runs that are shown.
pub(crate) const RUNS: usize = 4;
/// Surfels of all of them together, and returns: a page is to be mailed.
const SURFELS: u64 = 120_000;
const RETURNS: u64 = 40_000;
/// So much is shown beyond the way, metres of a drive.
const MARGIN_M: f64 = 50.0;
/// Bytes of a point: x, y, z as parts of the whole, little-endian, its [kind](Point::kind), and nothing.
const BYTES: usize = 8;

/// Kinds from 0 to this are surfels, the more level the higher.
const LEVEL: u8 = 7;
/// The first of [`MISSED`].
const BEHIND: u8 = LEVEL + 1;

/// What kinds look like.
pub(crate) const SURFEL_COLOURS: [Rgb; 14] = [
    [86, 94, 104],
    [98, 106, 116],
    [110, 118, 128],
    [124, 131, 140],
    [138, 144, 152],
    [152, 158, 165],
    [166, 171, 178],
    [180, 184, 190],
    MISSED[0],
    MISSED[1],
    MISSED[2],
    MISSED[3],
    MISSED[4],
    MISSED[5],
];

/// A point of the sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Point {
    /// From the corner, in steps.
    steps: [u16; 3],
    kind: u8,
}

/// The sample of one run.
#[derive(Debug)]
pub(crate) struct Cloud {
    corner_m: [f64; 3],
    step_m: f64,
    scales: Scales,
    /// One return of so many.
    every: u64,
    share: u64,
    seen: u64,
    /// Surfels of the whole map, and how many of them are in the sample.
    pub(crate) surfels: [u64; 2],
    points: Vec<Point>,
}

impl Cloud {
    /// An empty sample around a way; one of `runs` on the page. `returns` is about how many will come by.
    pub(crate) fn new(
        way: &(impl Iterator<Item = [f64; 3]> + Clone),
        returns: u64,
        runs: usize,
        scales: Scales,
    ) -> Self {
        let metre_m = scales.lengths().metre_m;
        let end_m =
            |of: fn(f64, f64) -> f64, axis: usize| way.clone().map(|at| at[axis]).reduce(of).unwrap_or(0.0);
        let corner_m = [0, 1, 2].map(|axis| end_m(f64::min, axis) - metre_m * MARGIN_M);
        let size_m = [0, 1, 2].map(|axis| end_m(f64::max, axis) + metre_m * MARGIN_M - corner_m[axis]);
        let step_m = size_m.into_iter().fold(0.0, f64::max) / f64::from(u16::MAX);
        let runs = runs.clamp(1, RUNS) as u64;
        let (every, share) = (returns.div_ceil(RETURNS / runs).max(1), SURFELS / runs);
        Self { corner_m, step_m, scales, every, share, seen: 0, surfels: [0; 2], points: Vec::new() }
    }

    /// Steps of a place from the corner; `None` beyond what is shown.
    pub(crate) fn steps(&self, at_m: [f64; 3]) -> Option<[u16; 3]> {
        let steps: [f64; 3] =
            std::array::from_fn(|axis| ((at_m[axis] - self.corner_m[axis]) / self.step_m).round());
        let is_shown = steps.iter().all(|steps| (0.0..=f64::from(u16::MAX)).contains(steps));
        is_shown.then(|| steps.map(|steps| steps as u16))
    }

    /// Length of a step, metres.
    pub(crate) fn step_m(&self) -> f64 {
        self.step_m
    }

    /// The surfel of this number, of a map of so many.
    pub(crate) fn disc(&mut self, number: u64, of_all: u64, disc: &DiscInWorld) {
        self.surfels[0] = of_all;
        if !number.is_multiple_of(of_all.div_ceil(self.share).max(1)) {
            return;
        }
        if let Some(steps) = self.steps(disc.centre_in_world_m) {
            self.surfels[1] += 1;
            let kind = (disc.normal[2].abs() * f32::from(LEVEL)).round().clamp(0.0, f32::from(LEVEL)) as u8;
            self.points.push(Point { steps, kind });
        }
    }

    /// A return of a scan whose sensor was there.
    pub(crate) fn sampled(&mut self, sensor_m: [f64; 3], sampled: &SampledReturn) {
        self.seen += 1;
        let Some(residual_m) = sampled.residual_m.filter(|_| self.seen.is_multiple_of(self.every)) else {
            return;
        };
        let Some(number) = missed(residual_m, self.scales) else { return };
        let at_m = std::array::from_fn(|axis| sensor_m[axis] + f64::from(sampled.from_sensor_m[axis]));
        if let Some(steps) = self.steps(at_m) {
            self.points.push(Point { steps, kind: BEHIND + number });
        }
    }

    /// Points of the sample.
    pub(crate) fn len(&self) -> usize {
        self.points.len()
    }

    /// All points, as a graphics card takes them.
    pub(crate) fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(BYTES * self.points.len());
        for Point { steps, kind } in &self.points {
            bytes.extend(steps.iter().flat_map(|steps| steps.to_le_bytes()));
            bytes.extend([*kind, 0]);
        }
        bytes
    }

    /// The smallest and largest steps along each axis; `None` without points.
    pub(crate) fn ends(&self) -> Option<[[u16; 3]; 2]> {
        let first = self.points.first()?.steps;
        Some(self.points.iter().fold([first, first], |[low, high], point| {
            [
                std::array::from_fn(|axis| low[axis].min(point.steps[axis])),
                std::array::from_fn(|axis| high[axis].max(point.steps[axis])),
            ]
        }))
    }

    /// The sample from the south-west and above, without perspective: what is near hides what is far.
    pub(crate) fn picture(&self, width: usize, height: usize) -> Image {
        let mut image = Image::new(width, height);
        let Some([low, high]) = self.ends() else { return image };
        // Azimuth 30°, elevation 40°.
        let [sin_a, cos_a, sin_e, cos_e] = [0.5, 0.866_025_4, 0.642_787_6, 0.766_044_4];
        let seen = |steps: [f64; 3]| {
            let [x, y, z] = steps;
            let (right, deep) = (cos_a * x - sin_a * y, sin_a * x + cos_a * y);
            ([right, sin_e * deep + cos_e * z], cos_e * deep - sin_e * z)
        };
        let corners = (0..8).map(|corner: usize| {
            seen(std::array::from_fn(|axis| {
                f64::from(if corner >> axis & 1 == 0 { low[axis] } else { high[axis] })
            }))
            .0
        });
        let none = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
        let [least, most] = corners.fold(none, |[least, most], at| {
            [[0, 1].map(|k: usize| least[k].min(at[k])), [0, 1].map(|k: usize| most[k].max(at[k]))]
        });
        let size = [width as f64 - 2.0, height as f64 - 2.0];
        let scale = (0..2).map(|k| size[k] / (most[k] - least[k]).max(1.0)).fold(f64::INFINITY, f64::min);
        let margin = [0, 1].map(|k: usize| (size[k] - scale * (most[k] - least[k])) / 2.0);
        let mut nearest = vec![f64::INFINITY; width * height];
        for Point { steps, kind } in &self.points {
            let (at, deep) = seen(steps.map(f64::from));
            let [right, up] = [0, 1].map(|k: usize| margin[k] + scale * (at[k] - least[k]));
            let (column, row) = (right as usize, (size[1] - up).max(0.0) as usize);
            for (column, row) in [(column, row), (column + 1, row), (column, row + 1), (column + 1, row + 1)]
            {
                let Some(nearest) = nearest.get_mut(row * width + column).filter(|_| column < width) else {
                    continue;
                };
                if deep < *nearest {
                    *nearest = deep;
                    image.set(column as i32, row as i32, kind + 1);
                }
            }
        }
        image
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cloud() -> Cloud {
        Cloud::new(&[[4e5, 5e6, 100.0], [4e5 + 100.0, 5e6, 100.0]].into_iter(), 10, 1, Scales::Drive)
    }

    fn disc(x: f64, z: f64, normal: [f32; 3]) -> DiscInWorld {
        DiscInWorld { centre_in_world_m: [4e5 + x, 5e6, 100.0 + z], normal, radius_m: 0.1 }
    }

    #[test]
    fn points_are_where_they_were_and_of_their_kind() {
        let mut cloud = cloud();
        cloud.disc(0, 2, &disc(50.0, -2.0, [0.0, 0.0, -1.0]));
        cloud.disc(1, 2, &disc(500.0, 0.0, [1.0, 0.0, 0.0]));
        let sampled = |residual_m| SampledReturn {
            from_sensor_m: [10.0, 0.0, 0.0],
            direction: [1.0, 0.0, 0.0],
            residual_m,
            revisited: false,
        };
        for residual_m in [Some(0.05), None, Some(0.2), Some(-2.0)] {
            cloud.sampled([4e5, 5e6, 100.0], &sampled(residual_m));
        }
        assert_eq!(cloud.surfels, [2, 1], "one lies beyond");
        let kinds: Vec<u8> = cloud.points.iter().map(|point| point.kind).collect();
        assert_eq!(kinds, [LEVEL, BEHIND + 3, BEHIND + 2]);
        let bytes = cloud.to_bytes();
        assert_eq!(bytes.len(), BYTES * cloud.len());
        let x_m = f64::from(u16::from_le_bytes([bytes[0], bytes[1]])) * cloud.step_m();
        assert!((x_m - 100.0).abs() < cloud.step_m(), "{x_m}");
        assert!(cloud.steps([f64::NAN; 3]).is_none());
    }

    #[test]
    fn a_large_map_is_thinned_evenly() {
        let mut cloud = cloud();
        let of_all = 5 * SURFELS;
        (0..of_all).for_each(|k| cloud.disc(k, of_all, &disc(1e-4 * k as f64, 0.0, [0.0, 1.0, 0.0])));
        assert_eq!(cloud.surfels, [of_all, SURFELS]);
    }

    #[test]
    fn what_is_near_hides_what_is_far() {
        let mut cloud = cloud();
        assert!(cloud.ends().is_none());
        assert_eq!(cloud.picture(8, 8).get(4, 4), 0);
        // The lower one lies behind the upper one along the view.
        let (sin_e, cos_e) = (0.642_787_6, 0.766_044_4);
        for (deep, kind) in [(0.0, [0.0, 0.0, 1.0]), (20.0, [1.0, 0.0, 0.0])] {
            let mut far = disc(50.0 + 0.5 * cos_e * deep, -sin_e * deep, kind);
            far.centre_in_world_m[1] += 0.866_025_4 * cos_e * deep;
            cloud.disc(0, 1, &far);
        }
        let picture = cloud.picture(60, 40);
        let kinds: Vec<u8> = (0..40)
            .flat_map(|row| (0..60).map(move |column| (column, row)))
            .map(|(c, r)| picture.get(c, r))
            .collect();
        assert!(kinds.contains(&(LEVEL + 1)), "the near one is seen");
    }
}
