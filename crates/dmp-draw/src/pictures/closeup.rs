//! A place from above and from the side: the surfels of the map, and what rays find there.

use dmp_reduce::Scales;

use super::seen::SampledReturn;
use super::worst::WorstPlace;
use crate::colour::{MISSED, Rgb, missed};
use crate::image::Image;

/// A window reaches so far to each side of the middle of a place, in parts of its radius: 20 m on a drive.
const WINDOW: f64 = 20.0 / 15.0;
/// And at least so far, metres of a drive: the next wall is to be seen.
const LEAST_M: f64 = 10.0;
/// Pixels to each side of the middle.
const HALF_PX: f64 = 200.0;
/// In parts of that: how far below and above the sensor a picture from the side reaches, and how deep it is.
const BELOW: f64 = 0.25;
const ABOVE: f64 = 0.65;
const DEPTH: f64 = 0.4;
/// Steeper normals than this belong to the ground.
const LEVEL: f32 = 0.7;
/// Lines are no longer than this, so that they leave something to be seen, metres of a drive.
const LONGEST_LINE_M: f64 = 3.0;
/// Returns of a picture, about, and how many of them have their whole ray drawn.
const RETURNS: usize = 6000;
const RAYS: usize = 60;

/// Numbers of colours; what is drawn over what.
const GROUND: u8 = 1;
const WALL: u8 = 2;
const RAY: u8 = 3;
const FITS: u8 = 4;
/// The first of [`MISSED`].
const BEHIND: u8 = 5;

/// What the numbers look like.
pub(crate) const COLOURS: [Rgb; 10] = [
    [178, 182, 188],
    [120, 126, 134],
    [176, 158, 196],
    [38, 150, 120],
    MISSED[0],
    MISSED[1],
    MISSED[2],
    MISSED[3],
    MISSED[4],
    MISSED[5],
];

/// A surfel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DiscInWorld {
    /// Its middle, metres in the world of the run.
    pub centre_in_world_m: [f64; 3],
    /// Its unit normal; the sign means nothing.
    pub normal: [f32; 3],
    /// Its radius, metres.
    pub radius_m: f64,
}

/// Two pictures of a place.
#[derive(Debug)]
pub(crate) struct Closeup {
    centre_m: [f64; 3],
    along: [f64; 2],
    scales: Scales,
    pub(crate) half_m: f64,
    pub(crate) above: Image,
    pub(crate) side: Image,
    /// One return of so many is drawn, and one of so many has its whole ray drawn.
    every: usize,
    every_ray: usize,
    seen: usize,
}

impl Closeup {
    /// Pictures of nothing yet. `returns` is about how many sampled returns will come by.
    pub(crate) fn new(place: &WorstPlace, returns: usize, scales: Scales) -> Self {
        let height = ((BELOW + ABOVE) * HALF_PX) as usize;
        let metre_m = scales.lengths().metre_m;
        let every = returns.div_ceil(RETURNS).max(1);
        Self {
            centre_m: place.centre_in_world_m,
            along: place.along,
            scales,
            half_m: (WINDOW * place.radius_m).max(metre_m * LEAST_M),
            above: Image::new(2 * HALF_PX as usize, 2 * HALF_PX as usize),
            side: Image::new(2 * HALF_PX as usize, height),
            every,
            every_ray: every * RETURNS.div_ceil(RAYS),
            seen: 0,
        }
    }

    /// The columns and rows of the plane that a map must be asked for: smallest and largest x and y, metres.
    pub(crate) fn extent_m(&self) -> [[f64; 2]; 2] {
        let [x, y, _] = self.centre_m;
        [[x - self.half_m, y - self.half_m], [x + self.half_m, y + self.half_m]]
    }

    /// Pixel of a place, from above.
    pub(crate) fn above_px(&self, at_m: [f64; 3]) -> [f64; 2] {
        let scale = HALF_PX / self.half_m;
        let [x, y] = [0, 1].map(|axis| scale * (at_m[axis] - self.centre_m[axis]));
        [HALF_PX + x, HALF_PX - y]
    }

    /// Pixel of a place, from the side, seen with the way going to the right; and how far it is from the plane through
    /// the middle, metres.
    pub(crate) fn side_px(&self, at_m: [f64; 3]) -> ([f64; 2], f64) {
        let scale = HALF_PX / self.half_m;
        let from_centre: [f64; 3] = std::array::from_fn(|axis| at_m[axis] - self.centre_m[axis]);
        let [x, y, z] = from_centre;
        let right = self.along[0] * x + self.along[1] * y;
        let deep = -self.along[1] * x + self.along[0] * y;
        ([HALF_PX + scale * right, ABOVE * HALF_PX - scale * z], deep)
    }

    /// Draws a surfel.
    pub(crate) fn disc(&mut self, disc: &DiscInWorld) {
        let [x, y] = [0, 1].map(|axis: usize| disc.centre_in_world_m[axis] - self.centre_m[axis]);
        // A picture from the side may be turned: what is seen of it lies in this circle.
        let within_m = std::f64::consts::SQRT_2 * self.half_m + disc.radius_m;
        if x * x + y * y > within_m * within_m {
            return;
        }
        let radius_px = disc.radius_m * HALF_PX / self.half_m;
        if disc.normal[2].abs() > LEVEL {
            // Nearly level: a square from above, a line from the side.
            let size = ((2.0 * radius_px).ceil() as i32).clamp(1, 100);
            let ([column, row], half) = (self.above_px(disc.centre_in_world_m), 0.5 * f64::from(size));
            square(&mut self.above, [column - half, row - half], GROUND, [size, size]);
            let ([column, row], deep) = self.side_px(disc.centre_in_world_m);
            if deep.abs() <= DEPTH * self.half_m {
                square(&mut self.side, [column - half, row], GROUND, [size, 1]);
            }
            return;
        }
        // Two pixels wide each, so that no holes are left.
        let steps = ((0.6 * radius_px).ceil() as i32).clamp(1, 100);
        let [u, v] = tangents(disc.normal);
        for a in -steps..=steps {
            for b in -steps..=steps {
                let [a, b] = [a, b].map(|step| f64::from(step) / f64::from(steps));
                if a * a + b * b > 1.0 {
                    continue;
                }
                let at = |axis: usize| {
                    let offset = a * u[axis] + b * v[axis];
                    disc.centre_in_world_m[axis] + disc.radius_m * offset
                };
                self.dot([at(0), at(1), at(2)], WALL);
            }
        }
    }

    /// Draws a return of the place's scans: a dot, and a line to where the map predicts it.
    pub(crate) fn sampled(&mut self, sensor_m: [f64; 3], sampled: &SampledReturn) {
        self.seen += 1;
        let Some(residual_m) = sampled.residual_m else { return };
        if !self.seen.is_multiple_of(self.every) {
            return;
        }
        let from_sensor_m = sampled.from_sensor_m.map(f64::from);
        let longest_m = self.scales.lengths().metre_m * LONGEST_LINE_M;
        let drawn_m = f64::from(residual_m).clamp(-longest_m, longest_m);
        let at = |from_return_m: f64| -> [f64; 3] {
            let along = |axis: usize| from_return_m * f64::from(sampled.direction[axis]);
            std::array::from_fn(|axis| sensor_m[axis] + from_sensor_m[axis] + along(axis))
        };
        let (measured, predicted) = (at(0.0), at(-drawn_m));
        if self.seen.is_multiple_of(self.every_ray) {
            let range_m = from_sensor_m.iter().map(|m| m * m).sum::<f64>().sqrt();
            self.segment(at(-range_m), measured, RAY);
        }
        let colour = missed(residual_m, self.scales).map_or(FITS, |number| BEHIND + number);
        if colour != FITS {
            self.segment(measured, predicted, colour);
        }
        self.dot(measured, colour);
    }

    /// Two pixels by two.
    fn dot(&mut self, at_m: [f64; 3], colour: u8) {
        let above = self.above_px(at_m);
        let (side, deep) = self.side_px(at_m);
        square(&mut self.above, above, colour, [2, 2]);
        if deep.abs() <= DEPTH * self.half_m {
            square(&mut self.side, side, colour, [2, 2]);
        }
    }

    fn segment(&mut self, from_m: [f64; 3], to_m: [f64; 3], colour: u8) {
        let [from, to] = [from_m, to_m].map(|at_m| self.above_px(at_m));
        self.above.line(from, to, colour);
        let [(from, from_deep), (to, to_deep)] = [from_m, to_m].map(|at_m| self.side_px(at_m));
        if from_deep.abs().max(to_deep.abs()) <= DEPTH * self.half_m {
            self.side.line(from, to, colour);
        }
    }
}

/// Raises so many pixels of so many rows, from one to the right and down.
fn square(image: &mut Image, at: [f64; 2], colour: u8, [width, height]: [i32; 2]) {
    // Rounded down; what is far outside stays there.
    let [column, row] = at.map(|px| (px.clamp(-1e6, 1e6) + 1e6) as i32 - 1_000_000);
    for down in 0..height {
        for right in 0..width {
            image.raise(column + right, row + down, colour);
        }
    }
}

/// Two unit vectors in the plane of a disc.
fn tangents(normal: [f32; 3]) -> [[f64; 3]; 2] {
    let n = normal.map(f64::from);
    let other = if n[2].abs() < 0.9 { [0.0, 0.0, 1.0] } else { [1.0, 0.0, 0.0] };
    let u = cross(n, other);
    let length = u.iter().map(|c| c * c).sum::<f64>().sqrt().max(1e-9);
    let u = u.map(|c| c / length);
    [u, cross(n, u)]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pictures::seen::FrameScore;

    /// A place at which the way goes north.
    fn closeup() -> Closeup {
        let place = WorstPlace {
            run: 0,
            centre_in_world_m: [4e5, 5e6, 100.0],
            radius_m: 15.0,
            along: [0.0, 1.0],
            score: FrameScore::default(),
            best: None,
            passes: Vec::new(),
        };
        Closeup::new(&place, 10, Scales::Drive)
    }

    #[test]
    fn a_wall_is_a_line_from_above_and_a_disc_from_the_side() {
        let mut closeup = closeup();
        let wall = |normal| DiscInWorld { centre_in_world_m: [4e5 + 5.0, 5e6, 101.0], normal, radius_m: 0.5 };
        closeup.disc(&wall([1.0, 0.0, 0.0]));
        let drawn = |image: &Image| {
            let all = (0..image.height).flat_map(|row| (0..image.width).map(move |column| (column, row)));
            all.filter(|&(column, row)| image.get(column, row) == WALL).collect::<Vec<_>>()
        };
        // 10 pixels a metre: 5 m east of the middle, and a metre above the sensor.
        let above = drawn(&closeup.above);
        assert!(
            above.iter().all(|&(column, row)| column.abs_diff(250) <= 1 && (194..=206).contains(&row)),
            "{above:?}"
        );
        assert!(above.len() >= 10);
        let side = drawn(&closeup.side);
        assert!(
            side.iter().all(|&(column, row)| (194..=206).contains(&column) && (114..=126).contains(&row))
        );
        assert!(side.len() > 60, "{}", side.len());
        closeup.disc(&wall([0.0, 0.0, 1.0]));
        assert_eq!(closeup.above.get(252, 200), GROUND);
        assert_eq!(closeup.above.get(250, 200), WALL, "walls are over the ground");
    }

    #[test]
    fn residuals_are_lines_to_what_is_predicted() {
        let mut closeup = closeup();
        let sensor_m = [4e5, 5e6, 100.0];
        let east = |residual_m| SampledReturn {
            from_sensor_m: [10.0, 0.0, 0.0],
            direction: [1.0, 0.0, 0.0],
            residual_m,
            revisited: false,
        };
        closeup.sampled(sensor_m, &east(Some(2.0)));
        // The map has something 2 m in front of the return.
        assert_eq!([279, 281, 290, 299].map(|column| closeup.above.get(column, 200)), [0, 10, 10, 10]);
        closeup.sampled(sensor_m, &east(Some(-0.2)));
        assert_eq!(closeup.above.get(301, 200), 10, "the larger error is drawn over the smaller one");
        assert_eq!(closeup.above.get(302, 200), BEHIND);
        closeup.sampled(sensor_m, &east(None));
        assert_eq!(closeup.side.get(200, 130), 0, "10 m beside the way is too deep");
    }
}
