//! Which solids a ray may meet: a uniform grid of columns.

use nalgebra::Vector3;

use crate::parts::shape::Shape;

const CELL_M: f64 = 3.0;

/// Lists of solids by column of 3 × 3 m, with the heights between which a column is not empty.
#[derive(Debug, Clone)]
pub(crate) struct Grid {
    corner: [f64; 2],
    size: [usize; 2],
    /// `items[starts[c]..starts[c + 1]]` are the solids of column `c`.
    starts: Vec<u32>,
    items: Vec<u32>,
    heights: Vec<(f64, f64)>,
}

impl Grid {
    pub(crate) fn new<'a>(shapes: impl Iterator<Item = &'a Shape>) -> Self {
        let bounds: Vec<_> = shapes.map(Shape::bounds).collect();
        let corner = [0, 1].map(|k| bounds.iter().map(|b| b.0[k]).fold(f64::INFINITY, f64::min));
        let upper = [0, 1].map(|k| bounds.iter().map(|b| b.1[k]).fold(f64::NEG_INFINITY, f64::max));
        let size = [0, 1].map(|k| ((upper[k] - corner[k]) / CELL_M).floor().max(0.0) as usize + 1);
        let mut grid =
            Self { corner, size, starts: vec![0; size[0] * size[1] + 1], items: vec![], heights: vec![] };
        grid.heights = vec![(f64::INFINITY, f64::NEG_INFINITY); size[0] * size[1]];
        for (lower, upper) in &bounds {
            for column in grid.columns(lower, upper) {
                grid.starts[column + 1] += 1;
                let (low, high) = &mut grid.heights[column];
                (*low, *high) = (low.min(lower.z), high.max(upper.z));
            }
        }
        for column in 0..size[0] * size[1] {
            grid.starts[column + 1] += grid.starts[column];
        }
        let mut next = grid.starts.clone();
        grid.items = vec![0; grid.starts[size[0] * size[1]] as usize];
        for (index, (lower, upper)) in bounds.iter().enumerate() {
            for column in grid.columns(lower, upper) {
                grid.items[next[column] as usize] = index as u32;
                next[column] += 1;
            }
        }
        grid
    }

    fn columns(&self, lower: &Vector3<f64>, upper: &Vector3<f64>) -> impl Iterator<Item = usize> + use<> {
        let cell = |k: usize, at: f64| ((at - self.corner[k]) / CELL_M).floor() as usize;
        let width = self.size[0];
        let along_x = cell(0, lower.x)..=cell(0, upper.x);
        (cell(1, lower.y)..=cell(1, upper.y)).flat_map(move |j| along_x.clone().map(move |i| j * width + i))
    }

    /// Visits the columns along a ray, nearest first, until `far_m`. `visit` gets the solids of a column
    /// and the range beyond which nothing matters any more, and may lower it.
    pub(crate) fn walk(
        &self,
        origin: Vector3<f64>,
        direction: Vector3<f64>,
        mut far_m: f64,
        mut visit: impl FnMut(&[u32], &mut f64),
    ) {
        if self.items.is_empty() {
            return;
        }
        let (mut enter, mut leave) = (0.0, far_m);
        for k in 0..2 {
            let (low, high) =
                (self.corner[k] - origin[k], self.corner[k] + self.size[k] as f64 * CELL_M - origin[k]);
            if direction[k] == 0.0 {
                if low > 0.0 || high <= 0.0 {
                    return;
                }
            } else {
                let (a, b) = (low / direction[k], high / direction[k]);
                (enter, leave) = (f64::max(enter, a.min(b)), f64::min(leave, a.max(b)));
            }
        }
        if enter > leave {
            return;
        }
        let start = origin + direction * enter;
        let mut cell = [0, 1].map(|k| {
            let cell = ((start[k] - self.corner[k]) / CELL_M).floor();
            cell.clamp(0.0, (self.size[k] - 1) as f64) as i64
        });
        // Range at which the next border of the cell is crossed, along each axis.
        let border = |k: usize, cell: i64| {
            let at = self.corner[k] + (cell + i64::from(direction[k] > 0.0)) as f64 * CELL_M;
            if direction[k] == 0.0 { f64::INFINITY } else { (at - origin[k]) / direction[k] }
        };
        let mut next = [border(0, cell[0]), border(1, cell[1])];
        while enter <= far_m {
            let column = cell[1] as usize * self.size[0] + cell[0] as usize;
            let exit = next[0].min(next[1]);
            let (low, high) = self.heights[column];
            let (z0, z1) = (origin.z + direction.z * enter, origin.z + direction.z * exit.min(far_m));
            if z0.min(z1) <= high && z0.max(z1) >= low {
                let range = self.starts[column] as usize..self.starts[column + 1] as usize;
                visit(&self.items[range], &mut far_m);
            }
            let k = usize::from(next[1] < next[0]);
            cell[k] += if direction[k] > 0.0 { 1 } else { -1 };
            if exit == f64::INFINITY || cell[k] < 0 || cell[k] >= self.size[k] as i64 {
                return;
            }
            enter = exit;
            next[k] = border(k, cell[k]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    #[test]
    fn the_grid_finds_what_a_search_through_all_finds() {
        let mut random = Random::new(4, &[]);
        let shapes: Vec<Shape> = (0..300)
            .map(|_| {
                let corner =
                    Vector3::from_fn(|k, _| random.between(-60.0, 60.0) * if k == 2 { 0.1 } else { 1.0 });
                Shape::upright(corner, corner + Vector3::from_fn(|_, _| random.between(0.1, 6.0)))
            })
            .collect();
        let grid = Grid::new(shapes.iter());
        let nearest = |origin, direction, items: &mut dyn Iterator<Item = &u32>, far: f64| {
            items
                .filter_map(|&i| shapes[i as usize].entry(origin, direction))
                .map(|e| e.range_m)
                .fold(far, f64::min)
        };
        let all: Vec<u32> = (0..shapes.len() as u32).collect();
        for n in 0..3000 {
            let origin =
                Vector3::from_fn(|k, _| random.between(-80.0, 80.0) * if k == 2 { 0.1 } else { 1.0 });
            let mut direction =
                Vector3::from_fn(|_, _| random.normal()).component_mul(&Vector3::new(1.0, 1.0, 0.1));
            if n % 10 < 2 {
                direction[n % 10] = 0.0;
            }
            if n % 100 == 5 {
                direction = Vector3::new(0.0, 0.0, -1.0);
            }
            let direction = direction.normalize();
            let mut found = 90.0;
            grid.walk(origin, direction, found, |items, far| {
                found = nearest(origin, direction, &mut items.iter(), *far);
                *far = found;
            });
            assert_eq!(found, nearest(origin, direction, &mut all.iter(), 90.0), "{origin:?} {direction:?}");
        }
    }
}
