//! What stands on one block of a city and in the two streets that start at its south-western crossing.

use nalgebra::Vector3;

use crate::city::plan::{Plan, Street, Use};
use crate::city::terrain::Terrain;
use crate::parts::building::{Area, Storeys, build_block, build_hall};
use crate::parts::shape::Shape;
use crate::parts::solid::{Solid, Surface};
use crate::parts::street::{Stretch, car, furnish_street, plant_tree, put_pole};
use crate::random::Random;

/// Nothing stands in a street nearer than this to a street that crosses it, metres.
const CLEAR_M: f64 = 3.5;
/// Avenues, of at least this width, have a row of trees in their middle, metres.
const AVENUE_M: f64 = 24.0;

/// Everything of the block north-east of crossing `cell`: a function of the plan and the cell alone.
pub(crate) fn build(plan: Plan, cell: [i64; 2]) -> Vec<Solid> {
    let terrain = Terrain { plan };
    let mut builder = Builder { terrain, random: plan.random(b'b', &cell), solids: Vec::new() };
    let [here, next] = [0, 1].map(|ahead| [0, 1].map(|axis| plan.street(axis, cell[axis] + ahead)));
    let area =
        [0, 1].map(|k| [here[k].middle_m + here[k].width_m / 2.0, next[k].middle_m - next[k].width_m / 2.0]);
    match plan.usage(cell) {
        Use::Houses(storeys) => builder.houses(area, storeys),
        Use::Lanes(storeys) => builder.lanes(area, storeys),
        Use::Halls => builder.halls(area),
        Use::Park => builder.park(area),
        Use::Square => builder.square(area),
    }
    for (axis, next) in next.into_iter().enumerate() {
        let mut random = plan.random(b's', &[cell[0], cell[1], axis as i64]);
        builder.street(here, next, axis, &mut random);
    }
    builder.solids
}

struct Builder {
    terrain: Terrain,
    random: Random,
    solids: Vec<Solid>,
}

impl Builder {
    fn ground(&self, x: f64, y: f64) -> Vector3<f64> {
        Vector3::new(x, y, self.terrain.at(x, y).0)
    }

    fn houses(&mut self, [east, north]: Area, storeys: Storeys) {
        let size = [east, north].map(|[from, to]| to - from);
        build_block([east[0], north[0]], size, storeys, &self.terrain, &mut self.random, &mut self.solids);
    }

    /// Quarters the block by two lanes.
    fn lanes(&mut self, area: Area, storeys: Storeys) {
        let halves = area.map(|[from, to]| {
            let middle = f64::midpoint(from, to) + self.random.between(-4.0, 4.0);
            let half_m = self.random.between(2.0, 4.5);
            [[from, middle - half_m], [middle + half_m, to]]
        });
        for north in halves[1] {
            for east in halves[0] {
                self.houses([east, north], storeys);
            }
        }
    }

    fn halls(&mut self, [east, north]: Area) {
        let count = 1 + self.random.index(2);
        let width_m = (east[1] - east[0]) / count as f64;
        for hall in 0..count {
            let west = east[0] + width_m * hall as f64;
            let inset = [0; 4].map(|_| self.random.between(1.0, 7.0));
            let area =
                [[west + inset[0], west + width_m - inset[1]], [north[0] + inset[2], north[1] - inset[3]]];
            self.hall(area, [6.0, 30.0]);
        }
        self.scatter([east, north], 6, |builder, foot| put_pole(foot, 4.0, 0.08, &mut builder.solids));
    }

    /// A hall that stands on the lowest ground under it.
    fn hall(&mut self, area: Area, tops_m: [f64; 2]) {
        let [east, north] = area;
        let corners = [[0, 0], [0, 1], [1, 0], [1, 1]].map(|[a, b]| self.ground(east[a], north[b]).z);
        let low_m = corners.iter().copied().fold(f64::INFINITY, f64::min) - 1.0;
        let top_m = self.random.between(tops_m[0], tops_m[1]);
        let first = self.solids.len();
        build_hall(area, top_m, &self.terrain, &mut self.random, &mut self.solids);
        for solid in &mut self.solids[first..] {
            if let Shape::Box { centre, .. } = &mut solid.shape {
                centre.z += low_m;
            }
        }
    }

    fn park(&mut self, area: Area) {
        let trees = 14 + self.random.index(14);
        self.scatter(area, trees, |builder, foot| {
            plant_tree(foot, &mut builder.random, &mut builder.solids);
        });
        self.scatter(area, 6, |builder, foot| put_pole(foot, 3.8, 0.07, &mut builder.solids));
        self.scatter(area, 10, Self::bench);
        // A hedge along two of the sides.
        for (axis, side) in [(0, 0), (1, 1)] {
            let [from, to] = area[axis];
            let across = area[1 - axis][side];
            let mut start = from;
            while start + 4.0 < to {
                let [a, b] = if axis == 0 { [start, across] } else { [across, start] };
                let foot = self.ground(a, b);
                let half = if axis == 0 { [2.0, 0.3] } else { [0.3, 2.0] };
                let reach = Vector3::new(half[0], half[1], 0.0);
                let shape = Shape::upright(
                    foot - reach - Vector3::z(),
                    foot + reach + Vector3::z() * self.random.between(0.8, 1.3),
                );
                self.solids.push(Solid { shape, reflectivity: 0.35, surface: Surface::Plant });
                start += self.random.between(4.0, 8.0);
            }
        }
    }

    fn square(&mut self, area: Area) {
        let [east, north] = area;
        let share = self.random.between(0.35, 0.6);
        let hall_north = [north[0] + (north[1] - north[0]) * share, north[1] - 3.0];
        self.hall([[east[0] + 4.0, east[1] - 4.0], hall_north], [9.0, 24.0]);
        let open = [[east[0] + 3.0, east[1] - 3.0], [north[0] + 2.0, hall_north[0] - 4.0]];
        self.scatter(open, 5, |builder, foot| plant_tree(foot, &mut builder.random, &mut builder.solids));
        self.scatter(open, 6, Self::bench);
        self.scatter(open, 5, |builder, foot| put_pole(foot, 5.0, 0.09, &mut builder.solids));
        self.scatter(open, 8, |builder, foot| {
            let yaw = builder.random.between(-0.05, 0.05) + std::f64::consts::FRAC_PI_2;
            let reflectivity = builder.random.between(0.08, 0.6);
            builder.solids.extend(car(foot, yaw, reflectivity, Surface::ParkedCar));
        });
        // A fountain: a low basin.
        let foot = self.ground(f64::midpoint(east[0], east[1]), f64::midpoint(open[1][0], open[1][1]));
        let radius_m = self.random.between(1.5, 3.0);
        let shape = Shape::Cylinder { foot: foot - Vector3::z(), radius_m, height_m: 1.7 };
        self.solids.push(Solid { shape, reflectivity: 0.5, surface: Surface::Building });
    }

    fn bench(&mut self, foot: Vector3<f64>) {
        let reach = if self.random.chance(0.5) { [0.9, 0.25] } else { [0.25, 0.9] };
        let reach = Vector3::new(reach[0], reach[1], 0.0);
        let shape = Shape::upright(foot - reach - Vector3::z(), foot + reach + Vector3::z() * 0.45);
        self.solids.push(Solid { shape, reflectivity: 0.4, surface: Surface::Building });
    }

    /// Puts `count` things somewhere on an area.
    fn scatter(&mut self, [east, north]: Area, count: usize, put: impl Fn(&mut Self, Vector3<f64>)) {
        for _ in 0..count {
            let [x, y] = [east, north].map(|[from, to]| self.random.between(from, to));
            let foot = self.ground(x, y);
            put(self, foot);
        }
    }

    /// The street from the crossing of the streets `here` to that with `next`.
    fn street(&mut self, here: [Street; 2], next: Street, axis: usize, random: &mut Random) {
        // A street along one axis lies at a place on the other.
        let (along, across) = (here[1 - axis], here[axis]);
        let stretch = Stretch {
            start: here.map(|street| street.middle_m),
            axis,
            length_m: next.middle_m - across.middle_m,
            width_m: along.width_m,
            clear_m: [across, next].map(|street| street.width_m / 2.0 + CLEAR_M),
            corner_m: across.width_m / 2.0,
            parked: random.between(0.1, 0.6),
        };
        furnish_street(&stretch, &self.terrain, random, &mut self.solids);
        if along.width_m < AVENUE_M {
            return;
        }
        // The lanes lie beside the trees in the middle.
        let mut at_m = stretch.clear_m[0] + 4.0;
        while at_m < stretch.length_m - stretch.clear_m[1] - 4.0 {
            let mut place = stretch.start;
            place[axis] += at_m;
            // Crowns reach 2.3 m, and one drives beside them, not through.
            let foot = self.ground(place[0], place[1]);
            put_pole(foot, random.between(6.0, 8.0), 0.1, &mut self.solids);
            at_m += random.between(9.0, 22.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_block_keeps_to_its_cell_and_off_the_lanes() {
        let plan = Plan { seed: 8 };
        for cell in (0..40).map(|k| [k * 13 - 200, 5 - k * 7]) {
            let [west_south, east_north] = [0, 1].map(|k| plan.crossing([cell[0] + k, cell[1] + k]));
            for solid in build(plan, cell) {
                let (low, high) = solid.shape.bounds();
                for k in 0..2 {
                    assert!(
                        low[k] > west_south[k] - 16.0 && high[k] < east_north[k] + 16.0,
                        "{cell:?} {solid:?}"
                    );
                    // Up to 2.5 m above the ground, the right-hand lanes of the streets are free.
                    let lane = west_south[k] + 1.2..west_south[k] + 2.6;
                    let ground = Terrain { plan }.at(low.x, low.y).0;
                    let free = high[k] < lane.start || low[k] > lane.end || low.z > ground + 2.3;
                    assert!(
                        free || solid.surface == Surface::Plant && low.z > ground,
                        "{cell:?} {k} {solid:?}"
                    );
                }
            }
        }
    }
}
