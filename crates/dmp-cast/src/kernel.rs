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
            let cos = (n[0] * d[0] + n[1] * d[1] + n[2] * d[2]).abs();
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
