use dmp_map::{Independence, Surfel};

use crate::tree::{CastTile, Node};

/// A disc is crossed only where the ray is not almost parallel to it: |n·d| of at least this.
const MIN_COS: f32 = 0.01;

/// A ray inside one tile: ranges count from the place where it enters the tile.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TileRay {
    /// From the tile's origin, metres.
    pub(crate) origin_m: [f32; 3],
    pub(crate) direction: [f32; 3],
    pub(crate) measured_m: f32,
    /// Crossings are looked for between these.
    pub(crate) from_m: f32,
    pub(crate) to_m: f32,
    pub(crate) independence: Option<Independence>,
    pub(crate) revisit: Option<Independence>,
}

/// The best answers so far, as bounds for what is still worth looking at; infinite where there is none,
/// negatively infinite where the answer is final.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TileAnswer {
    pub(crate) first_m: f32,
    pub(crate) nearest_m: f32,
    /// |nearest − measured|; before there is one, the half-width of the window.
    pub(crate) gap_m: f32,
    pub(crate) independent_m: f32,
    /// |n·d| there.
    pub(crate) independent_cos: f32,
    pub(crate) revisited: bool,
}

impl TileAnswer {
    /// Whether a box crossed between `enter_m` and `leave_m` may improve any answer.
    #[inline]
    fn may_improve(&self, ray: &TileRay, node: &Node, enter_m: f32, leave_m: f32) -> bool {
        let may_hold = |independence: Option<Independence>| {
            independence.is_some_and(|i| i.holds(node.min_third_lowest, node.max_third_highest))
        };
        enter_m < self.first_m
            || (enter_m <= ray.measured_m + self.gap_m && leave_m >= ray.measured_m - self.gap_m)
            || (enter_m < self.independent_m && may_hold(ray.independence))
            || (!self.revisited && may_hold(ray.revisit))
    }

    #[inline]
    fn take(&mut self, ray: &TileRay, surfel: &Surfel, range_m: f32) {
        self.first_m = self.first_m.min(range_m);
        let gap_m = (range_m - ray.measured_m).abs();
        if gap_m < self.gap_m || (gap_m == self.gap_m && range_m < self.nearest_m) {
            (self.nearest_m, self.gap_m) = (range_m, gap_m);
        }
        let holds = |independence: Option<Independence>| {
            independence.is_some_and(|i| i.holds(surfel.third_lowest, surfel.third_highest))
        };
        if range_m <= self.independent_m && holds(ray.independence) {
            let (n, d) = (surfel.normal, ray.direction);
            // Rounding must not lift it over 1.
            let cos = (n[0] * d[0] + n[1] * d[1] + n[2] * d[2]).abs().min(1.0);
            // Of two at the same range the one hit more squarely, whichever came first.
            if range_m < self.independent_m || cos > self.independent_cos {
                (self.independent_m, self.independent_cos) = (range_m, cos);
            }
        }
        self.revisited = self.revisited || holds(ray.revisit);
    }
}

/// Where the ray crosses the disc, if it does.
#[inline]
fn crossing(ray: &TileRay, surfel: &Surfel, radius_m: f32) -> Option<f32> {
    let (o, d) = (ray.origin_m, ray.direction);
    let (c, n) = (surfel.centre_in_tile_m, surfel.normal);
    let cos = n[0] * d[0] + n[1] * d[1] + n[2] * d[2];
    let to_centre = [c[0] - o[0], c[1] - o[1], c[2] - o[2]];
    let range_m = (n[0] * to_centre[0] + n[1] * to_centre[1] + n[2] * to_centre[2]) / cos;
    let off = [range_m * d[0] - to_centre[0], range_m * d[1] - to_centre[1], range_m * d[2] - to_centre[2]];
    let off2 = off[0] * off[0] + off[1] * off[1] + off[2] * off[2];
    // NaN (a ray within the disc's plane) fails every comparison.
    let hit =
        cos.abs() >= MIN_COS && off2 <= radius_m * radius_m && range_m >= ray.from_m && range_m <= ray.to_m;
    hit.then_some(range_m)
}

/// Where the ray enters and leaves a box; nothing when it misses it.
#[inline]
fn through(ray: &TileRay, inverse: [f32; 3], node: &Node) -> Option<(f32, f32)> {
    let (mut enter, mut leave) = (ray.from_m, ray.to_m);
    for (k, inverse) in inverse.into_iter().enumerate() {
        let a = (node.min[k] - ray.origin_m[k]) * inverse;
        let b = (node.max[k] - ray.origin_m[k]) * inverse;
        // A ray along a face gives NaN (0 · ∞), which min and max pass over. Boxes have slack, so that no
        // disc lies in a face.
        enter = enter.max(a.min(b));
        leave = leave.min(a.max(b));
    }
    // Three rounding errors of either side, so that a box is never lost to them.
    (enter <= leave * (1.0 + 4.0 * f32::EPSILON) + 1e-5).then_some((enter, leave))
}

/// Tells `each` every disc the ray crosses and where, in no order that means anything.
pub(crate) fn each_crossing(
    tile: &CastTile,
    ray: &TileRay,
    stack: &mut Vec<u32>,
    mut each: impl FnMut(usize, f32),
) {
    let inverse = ray.direction.map(|d| 1.0 / d);
    stack.clear();
    if !tile.nodes.is_empty() {
        stack.push(0);
    }
    while let Some(index) = stack.pop() {
        let node = &tile.nodes[index as usize];
        if through(ray, inverse, node).is_none() {
            continue;
        }
        if node.surfels == 0 {
            stack.extend([node.first, node.first + 1]);
            continue;
        }
        let first = node.first as usize;
        for place in first..first + node.surfels as usize {
            if let Some(range_m) = crossing(ray, &tile.surfels[place], tile.radius_m) {
                each(place, range_m);
            }
        }
    }
}

/// Improves `answer` by the tile's crossings. The result does not depend on the shape of the tree:
/// boxes are left out only when nothing in them can matter.
pub(crate) fn cast(tile: &CastTile, ray: &TileRay, answer: &mut TileAnswer, stack: &mut Vec<u32>) {
    let inverse = ray.direction.map(|d| 1.0 / d);
    stack.clear();
    if !tile.nodes.is_empty() {
        stack.push(0);
    }
    while let Some(index) = stack.pop() {
        let node = &tile.nodes[index as usize];
        let Some((enter, leave)) = through(ray, inverse, node) else { continue };
        if !answer.may_improve(ray, node, enter - 1e-4, leave + 1e-4) {
            continue;
        }
        if node.surfels == 0 {
            // The child whose centre lies nearer along the ray is taken first.
            let (a, b) = (&tile.nodes[node.first as usize], &tile.nodes[node.first as usize + 1]);
            let along = |n: &Node| -> f32 { (0..3).map(|k| (n.min[k] + n.max[k]) * ray.direction[k]).sum() };
            let a_first = along(a) <= along(b);
            stack.push(node.first + u32::from(a_first));
            stack.push(node.first + u32::from(!a_first));
        } else {
            let first = node.first as usize;
            for surfel in &tile.surfels[first..first + node.surfels as usize] {
                if let Some(range_m) = crossing(ray, surfel, tile.radius_m) {
                    answer.take(ray, surfel, range_m);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Discs around one place, seen from segment 0, with every `leaf` of them in a leaf of one tree.
    fn tile_of(centre_m: [f32; 3], normals: &[[f32; 3]], leaf: usize) -> CastTile {
        let surfel =
            |&normal| Surfel { centre_in_tile_m: centre_m, normal, third_lowest: 0, third_highest: 0 };
        let node = |first: usize, surfels: usize| Node {
            min: centre_m.map(|c| c - 1.0),
            max: centre_m.map(|c| c + 1.0),
            first: first as u32,
            surfels: surfels as u32,
            min_third_lowest: 0,
            max_third_highest: 0,
        };
        let nodes = match normals.len() - leaf {
            0 => vec![node(0, leaf)],
            rest => vec![node(1, 0), node(0, leaf), node(leaf, rest)],
        };
        let surfels = normals.iter().map(surfel).collect();
        CastTile { origin_in_world_m: [0.0; 3], radius_m: 0.5, surfels, nodes }
    }

    /// The range and |n·d| of the independent crossing of a ray from the origin.
    fn independent(tile: &CastTile, direction: [f32; 3]) -> (f32, f32) {
        let ray = TileRay {
            origin_m: [0.0; 3],
            direction,
            measured_m: 4.0,
            from_m: 0.0,
            to_m: 60.0,
            independence: Some(Independence::of(9, 1)),
            revisit: None,
        };
        let mut answer = TileAnswer {
            first_m: f32::INFINITY,
            nearest_m: f32::INFINITY,
            gap_m: 5.0,
            independent_m: f32::INFINITY,
            independent_cos: 0.0,
            revisited: false,
        };
        cast(tile, &ray, &mut answer, &mut Vec::new());
        (answer.independent_m, answer.independent_cos)
    }

    #[test]
    fn of_two_discs_at_the_same_range_the_one_hit_more_squarely_counts() {
        // Times 4 and by itself again: all three are crossed at 4 m to the last bit.
        let (square, oblique, grazed) = ([-1.0, 0.0, 0.0], [0.6, 0.8, 0.0], [0.28, 0.0, 0.96]);
        let cases = [([square, oblique], 1.0), ([square, grazed], 1.0), ([oblique, grazed], 0.6)];
        for ([a, b], cos) in cases {
            for normals in [[a, b], [b, a]] {
                for leaf in [1, 2] {
                    let tile = tile_of([4.0, 0.0, 0.0], &normals, leaf);
                    assert_eq!(independent(&tile, [1.0, 0.0, 0.0]), (4.0, cos), "{normals:?} {leaf}");
                }
            }
        }
    }

    #[test]
    fn a_disc_hit_squarely_is_not_hit_more_than_squarely() {
        let mut over = 0;
        for k in 0..200u8 {
            let t = f64::from(k) / 200.0;
            let d = [(1.0 - t * t) / (1.0 + t * t), 2.0 * t / (1.0 + t * t), 0.0].map(|c| c as f32);
            over += usize::from(d[0] * d[0] + d[1] * d[1] > 1.0);
            let (range_m, cos) = independent(&tile_of(d.map(|c| 4.0 * c), &[d], 1), d);
            assert!((range_m - 4.0).abs() < 1e-5 && (0.999_999..=1.0).contains(&cos), "{d:?} {cos}");
        }
        assert!(over > 0, "no product is rounded up");
    }
}
