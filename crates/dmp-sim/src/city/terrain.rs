//! The ground of a city: a smooth surface over the whole plane, made of heights on a lattice that each follow
//! from the seed.

use crate::city::plan::Plan;
use crate::parts::relief::Relief;

/// Distance of the lattice's points, metres.
const LATTICE_M: f64 = 16.0;
/// Hills: points of the lattice between two random heights, and how far up and down those go, metres.
const HILLS: [(i64, f64); 3] = [(20, 9.0), (5, 0.9), (1, 0.06)];

/// Heights everywhere: the uniform quadratic B-spline (C¹) of the lattice's heights.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Terrain {
    pub(crate) plan: Plan,
}

impl Terrain {
    /// Height at a point of the lattice: random heights some points apart, eased between them.
    fn control_m(self, [i, j]: [i64; 2]) -> f64 {
        let hill = |(layer, &(every, reach_m)): (usize, &(i64, f64))| {
            let random =
                |i: i64, j: i64| self.plan.random(b't', &[layer as i64, i, j]).between(-reach_m, reach_m);
            let ([i0, j0], ease) = ([i, j].map(|k| k.div_euclid(every)), |k: i64| {
                let u = k.rem_euclid(every) as f64 / every as f64;
                u * u * (3.0 - 2.0 * u)
            });
            let (u, v) = (ease(i), ease(j));
            let row = |j: i64| {
                let west = random(i0, j);
                if u == 0.0 { west } else { west + (random(i0 + 1, j) - west) * u }
            };
            let south = row(j0);
            if v == 0.0 { south } else { south + (row(j0 + 1) - south) * v }
        };
        HILLS.iter().enumerate().map(hill).sum()
    }

    /// The part of the ground within `reach_m` of a place, for fast answers.
    pub(crate) fn patch(self, [x, y]: [f64; 2], reach_m: f64) -> Patch {
        let index = |at: f64| (at / LATTICE_M).floor() as i64;
        let first = [index(x - reach_m) - 1, index(y - reach_m) - 1];
        let size = [index(x + reach_m) + 3 - first[0], index(y + reach_m) + 3 - first[1]].map(|n| n as usize);
        let point = |k: usize| [first[0] + (k % size[0]) as i64, first[1] + (k / size[0]) as i64];
        Patch { first, size, controls_m: (0..size[0] * size[1]).map(|k| self.control_m(point(k))).collect() }
    }

    /// Height and slope (∂z/∂x, ∂z/∂y) at a place.
    pub(crate) fn at(self, x: f64, y: f64) -> (f64, [f64; 2]) {
        spline(x, y, |i, j| [0, 1, 2].map(|b| [0, 1, 2].map(|a| self.control_m([i + a, j + b]))))
    }
}

impl Relief for Terrain {
    fn height_m(&self, x: f64, y: f64) -> f64 {
        self.at(x, y).0
    }
}

/// A part of the ground. Beyond its rim the answers go on from those at the rim.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Patch {
    first: [i64; 2],
    size: [usize; 2],
    controls_m: Vec<f64>,
}

impl Patch {
    /// Height and slope (∂z/∂x, ∂z/∂y) at a place: those of the terrain, to the bit.
    #[inline]
    pub(crate) fn at(&self, x: f64, y: f64) -> (f64, [f64; 2]) {
        spline(x, y, |i, j| {
            let within = |k: usize, at: i64| (at - self.first[k]).clamp(0, self.size[k] as i64 - 3) as usize;
            let (column, row) = (within(0, i), within(1, j));
            [0, 1, 2].map(|b| {
                let from = (row + b) * self.size[0] + column;
                let near = &self.controls_m[from..from + 3];
                [near[0], near[1], near[2]]
            })
        })
    }
}

impl Relief for Patch {
    #[inline]
    fn height_m(&self, x: f64, y: f64) -> f64 {
        self.at(x, y).0
    }
}

/// The uniform quadratic B-spline of the nine lattice points around a place: `controls_m` gives them, rows
/// from south to north, from the south-western one.
#[expect(
    clippy::inline_always,
    reason = "most ask for the height alone, and then half of it is not computed"
)]
#[inline(always)]
fn spline(x: f64, y: f64, controls_m: impl FnOnce(i64, i64) -> [[f64; 3]; 3]) -> (f64, [f64; 2]) {
    let (i, wx, dx) = weights(x / LATTICE_M);
    let (j, wy, dy) = weights(y / LATTICE_M);
    let rows = controls_m(i - 1, j - 1);
    let (mut height_m, mut slope) = (0.0, [0.0; 2]);
    for b in 0..3 {
        let (mut row, mut row_slope) = (0.0, 0.0);
        for a in 0..3 {
            row += wx[a] * rows[b][a];
            row_slope += dx[a] * rows[b][a];
        }
        height_m += wy[b] * row;
        slope[0] += wy[b] * row_slope;
        slope[1] += dy[b] * row;
    }
    (height_m, slope.map(|s| s / LATTICE_M))
}

/// The nearest lattice point, and the weights of it and its two neighbours with their derivatives.
#[inline]
fn weights(u: f64) -> (i64, [f64; 3], [f64; 3]) {
    // A cast and a comparison: `floor` is a call where the processor's own is not taken for granted.
    let towards_zero = (u + 0.5) as i64;
    let nearest = towards_zero - i64::from(towards_zero as f64 > u + 0.5);
    let f = u - nearest as f64;
    let (a, b) = (0.5 - f, 0.5 + f);
    (nearest, [0.5 * a * a, 0.75 - f * f, 0.5 * b * b], [-a, -2.0 * f, b])
}

#[cfg(test)]
mod tests {
    use super::*;

    const TERRAIN: Terrain = Terrain { plan: Plan { seed: 5 } };

    #[test]
    fn a_patch_is_the_terrain_to_the_bit() {
        for centre in [[0.0, 0.0], [-1234.5, 77.0], [4e5, -9e5]] {
            let patch = TERRAIN.patch(centre, 60.0);
            for k in 0..500 {
                let (x, y) =
                    (centre[0] - 60.0 + f64::from(k % 25) * 5.0, centre[1] - 60.0 + f64::from(k / 25) * 6.0);
                assert_eq!(patch.at(x, y), TERRAIN.at(x, y));
            }
        }
    }

    #[test]
    fn the_ground_is_hilly_and_smooth_and_its_slope_is_the_derivative() {
        let (mut low, mut high, mut steepest) = (f64::MAX, f64::MIN, 0.0);
        for k in 0..4000 {
            let (x, y) = (f64::from(k) * 1.7 - 900.0, f64::from(k % 83) * 21.0);
            let (height_m, slope) = TERRAIN.at(x, y);
            (low, high) = (height_m.min(low), height_m.max(high));
            steepest = f64::max(steepest, libm::hypot(slope[0], slope[1]));
            let step = 1e-4;
            for (k, moved) in [(0, TERRAIN.at(x + step, y).0), (1, TERRAIN.at(x, y + step).0)] {
                assert!(((moved - height_m) / step - slope[k]).abs() < 1e-4, "{x} {y}");
            }
        }
        assert!(high - low > 6.0 && high - low < 25.0, "{low} {high}");
        assert!(steepest > 0.03 && steepest < 0.25, "{steepest}");
    }
}
