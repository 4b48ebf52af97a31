//! Blocks of houses. A façade is a lattice of piers and bands before a wall, so that windows are recesses;
//! some houses have a bay, a porch, a garden or an alley beside them.

use nalgebra::Vector3;

use super::relief::Relief;
use super::shape::Shape;
use super::solid::{Solid, Surface};
use crate::random::Random;

/// One side of a block, seen from its street: `along` the façades, `inward` from the building line.
struct Frontage<'a> {
    corner: [f64; 2],
    along: [f64; 2],
    inward: [f64; 2],
    ground: &'a dyn Relief,
    solids: &'a mut Vec<Solid>,
}

impl Frontage<'_> {
    fn place(&self, along_m: f64, inward_m: f64) -> [f64; 2] {
        [0, 1].map(|k| self.corner[k] + self.along[k] * along_m + self.inward[k] * inward_m)
    }

    fn ground_m(&self, along_m: f64, inward_m: f64) -> f64 {
        let [x, y] = self.place(along_m, inward_m);
        self.ground.height_m(x, y)
    }

    /// A box that reaches over `along`, `inward` and `heights`, each from–to in metres.
    fn put(
        &mut self,
        along: [f64; 2],
        inward: [f64; 2],
        heights: [f64; 2],
        reflectivity: f64,
        surface: Surface,
    ) {
        let [a, b] = [0, 1].map(|k| {
            let [x, y] = self.place(along[k], inward[k]);
            Vector3::new(x, y, heights[k])
        });
        self.solids.push(Solid { shape: Shape::upright(a, b), reflectivity, surface });
    }
}

/// A rectangle from–to east and north, metres.
pub(crate) type Area = [[f64; 2]; 2];

/// The four sides of an area of such a size: the corner at which each starts, its direction, the one inward from it, and its
/// length, metres.
fn sides([[x0, x1], [y0, y1]]: Area, size: [f64; 2]) -> [([[f64; 2]; 3], f64); 4] {
    [
        ([[x0, y0], [1.0, 0.0], [0.0, 1.0]], size[0]),
        ([[x1, y0], [0.0, 1.0], [-1.0, 0.0]], size[1]),
        ([[x1, y1], [-1.0, 0.0], [0.0, -1.0]], size[0]),
        ([[x0, y1], [0.0, -1.0], [1.0, 0.0]], size[1]),
    ]
}

/// How high the houses of a block are: `least` storeys or up to `choices` − 1 more.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Storeys {
    pub(crate) least: usize,
    pub(crate) choices: usize,
}

/// Fills a block, from its south-western `corner`, with a row of houses along each of its four sides.
pub(crate) fn build_block(
    corner: [f64; 2],
    size: [f64; 2],
    storeys: Storeys,
    ground: &dyn Relief,
    random: &mut Random,
    solids: &mut Vec<Solid>,
) {
    let area = [0, 1].map(|k| [corner[k], corner[k] + size[k]]);
    let depth_m = (size[0].min(size[1]) / 2.0).min(9.0);
    for ([corner, along, inward], length_m) in sides(area, size) {
        let mut frontage = Frontage { corner, along, inward, ground, solids };
        let mut from = 0.0;
        while from < length_m {
            let mut to = from + random.between(6.0, 11.0);
            if length_m - to < 5.0 {
                to = length_m;
            }
            build_house(&mut frontage, [from, to], depth_m, storeys, random);
            from = to + if random.chance(0.2) { random.between(1.2, 3.0) } else { 0.0 };
        }
    }
}

/// Fills a block with one and the same house again and again: on `plots` (from–to along the side, metres) of a side of a
/// given length, the first from its start.
pub(crate) fn build_same_houses(
    corner: [f64; 2],
    size: [f64; 2],
    plots: impl Fn(f64) -> Vec<[f64; 2]>,
    ground: &dyn Relief,
    random: &Random,
    solids: &mut Vec<Solid>,
) {
    let area = [0, 1].map(|k| [corner[k], corner[k] + size[k]]);
    let depth_m = (size[0].min(size[1]) / 2.0).min(9.0);
    let storeys = Storeys { least: 3, choices: 1 };
    for ([corner, along, inward], length_m) in sides(area, size) {
        let mut frontage = Frontage { corner, along, inward, ground, solids };
        for plot in plots(length_m) {
            build_house(&mut frontage, plot, depth_m, storeys, &mut random.clone());
        }
    }
}

/// One large building over `area` (from–to east and north), `top_m` high: a core, and on its four sides a
/// lattice of pillars and bands before the windows.
pub(crate) fn build_hall(
    area: Area,
    top_m: f64,
    ground: &dyn Relief,
    random: &mut Random,
    solids: &mut Vec<Solid>,
) {
    let size = area.map(|[from, to]| to - from);
    let recess = random.between(0.15, 0.3);
    let albedo = random.between(0.35, 0.7);
    let floor_m = random.between(3.0, 3.6);
    for (side, ([corner, along, inward], length_m)) in sides(area, size).into_iter().enumerate() {
        let mut frontage = Frontage { corner, along, inward, ground, solids };
        if side == 0 {
            let inner = [recess, length_m - recess];
            frontage.put(inner, [recess, size[1] - recess], [-0.5, top_m], albedo * 0.5, Surface::Building);
        }
        let bays = (length_m / random.between(2.6, 4.2)).floor().max(1.0);
        let pitch_m = (length_m - 0.5) / bays;
        for pillar in 0..=bays as usize {
            let start = pitch_m * pillar as f64;
            frontage.put([start, start + 0.5], [0.0, recess], [-0.5, top_m], albedo, Surface::Building);
        }
        let mut low = -0.5;
        let mut sill = random.between(0.6, 1.0);
        while sill + 2.0 < top_m {
            frontage.put([0.0, length_m], [0.04, recess], [low, sill], albedo, Surface::Building);
            low = sill + 1.7;
            sill += floor_m;
        }
        frontage.put(
            [0.0, length_m],
            [0.04, recess],
            [low.min(top_m - 0.3), top_m],
            albedo,
            Surface::Building,
        );
    }
}

fn build_house(
    frontage: &mut Frontage<'_>,
    [from, to]: [f64; 2],
    depth_m: f64,
    storeys: Storeys,
    random: &mut Random,
) {
    let garden = random.chance(0.2);
    let front = if garden { random.between(2.0, 3.0) } else { random.between(0.0, 0.8) };
    let [a, b] = [from, to].map(|along| frontage.ground_m(along, front));
    // The ground floor starts at the middle of the slope, the walls reach below its lower end.
    let (base, low) = (f64::midpoint(a, b), a.min(b) - 1.5);
    let floors = storeys.least + random.index(storeys.choices);
    let floor_m = random.between(2.8, 3.4);
    let top = base + floor_m * floors as f64 + random.between(0.3, 1.2);
    let recess = random.between(0.12, 0.4);
    let albedo = random.between(0.3, 0.7);
    let wall = Surface::Building;

    // Windows are dark: less light comes back from the wall behind the lattice.
    frontage.put([from, to], [front + recess, depth_m], [low, top], albedo * 0.5, wall);
    let windows = ((to - from) / random.between(2.2, 2.8)).floor().max(1.0);
    let pier_m = (to - from - 1.25 * windows) / (windows + 1.0);
    for pier in 0..=windows as usize {
        let start = from + pier as f64 * (pier_m + 1.25);
        frontage.put([start, start + pier_m], [front, front + recess], [low, top], albedo, wall);
    }
    let mut band_low = low;
    for floor in 0..=floors {
        let sill = base + floor_m * floor as f64 + 0.9;
        let band_high = if floor == floors { top } else { sill };
        frontage.put([from, to], [front - 0.06, front + recess], [band_low, band_high], albedo, wall);
        band_low = sill + 1.4;
    }

    let somewhere = |random: &mut Random, width_m: f64| {
        let start = random.between(from, to - width_m);
        [start, start + width_m]
    };
    if random.chance(0.35) {
        let width_m = random.between(2.0, 3.2);
        let along = somewhere(random, width_m);
        let out = random.between(0.5, 0.9);
        let foot = if random.chance(0.5) { low } else { base + floor_m };
        frontage.put(along, [front - out, front], [foot, top - 0.8], albedo * 0.9, wall);
    }
    if random.chance(0.6) {
        let along = somewhere(random, 1.6);
        frontage.put(along, [front - 0.7, front], [low, base + random.between(0.15, 0.45)], 0.35, wall);
        frontage.put(along, [front - 0.9, front], [base + 2.5, base + 2.65], 0.3, wall);
    }
    if garden {
        let gate = somewhere(random, 1.2);
        let height = random.between(0.9, 1.4);
        for [start, end] in [[from, gate[0]], [gate[1], to]] {
            let foot = frontage.ground_m(f64::midpoint(start, end), 0.2);
            frontage.put([start, end], [0.0, 0.45], [foot - 0.6, foot + height], 0.35, Surface::Plant);
        }
    }
    if random.chance(0.5) {
        let [x, y] = frontage.place(to - 0.15, front - 0.12);
        let foot = Vector3::new(x, y, low);
        let shape = Shape::Cylinder { foot, radius_m: 0.06, height_m: top - low };
        frontage.solids.push(Solid { shape, reflectivity: 0.4, surface: wall });
    }
}
