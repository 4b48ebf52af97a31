//! What points of one tile are measured to: an index of points and triangles.

use rstar::{AABB, PointDistance, RTree, RTreeObject};

use super::Triangle;
use super::triangle::squared_distance;

/// A triangle's box is larger by this, metres: a bound is then below what is computed for the triangle
/// whatever the rounding, and the nearest is the nearest in any tree.
const BOX_SLACK_M: f64 = 1e-6;

/// What is measured to: the points and triangles near a cell.
#[derive(Debug)]
pub(super) struct Targets {
    points: RTree<[f64; 3]>,
    triangles: RTree<Facet>,
}

#[derive(Debug)]
struct Facet(Triangle);

impl RTreeObject for Facet {
    type Envelope = AABB<[f64; 3]>;

    fn envelope(&self) -> Self::Envelope {
        let [a, b, c] = self.0;
        let low = std::array::from_fn(|k| a[k].min(b[k]).min(c[k]) - BOX_SLACK_M);
        let high = std::array::from_fn(|k| a[k].max(b[k]).max(c[k]) + BOX_SLACK_M);
        AABB::from_corners(low, high)
    }
}

impl PointDistance for Facet {
    fn distance_2(&self, point: &[f64; 3]) -> f64 {
        squared_distance(*point, &self.0)
    }
}

impl Targets {
    /// Bytes that a point takes in the tree and while it is built.
    pub(super) const POINT_BYTES: u64 = 160;
    /// The same for a triangle.
    pub(super) const TRIANGLE_BYTES: u64 = 240;

    pub(super) fn new(points: Vec<[f64; 3]>, triangles: Vec<Triangle>) -> Self {
        let triangles = triangles.into_iter().map(Facet).collect();
        Self { points: RTree::bulk_load(points), triangles: RTree::bulk_load(triangles) }
    }

    /// Squared distance of the nearest; `None` where there is nothing.
    pub(super) fn nearest(&self, point: &[f64; 3]) -> Option<f64> {
        let to_point = self.points.nearest_neighbor(point).map(|near| near.distance_2(point));
        // The iterator goes by bounds alone, which the slack keeps honest.
        let to_triangle = self.triangles.nearest_neighbor_iter_with_distance_2(point).next();
        [to_point, to_triangle.map(|(_, d2)| d2)].into_iter().flatten().reduce(f64::min)
    }
}
