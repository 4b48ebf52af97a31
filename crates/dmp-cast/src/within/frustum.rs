//! A frustum around several rays.

use super::crossing::columns;
use super::packet_rays::{PacketRays, load3};
use super::tile::{Leaf, Node};
use crate::lanes::{Lanes, Mask, Simd, dot};

/// Tolerance for the rounding of rays and planes, and for the millimetre by which rays begin before a tile, metres.
const SLACK_M: f32 = 3e-3;
/// Rays farther than this from the packet's axis (cosine) make no frustum.
const LEAST_COS: f32 = 0.5;

/// Limit below which rays are faster as a packet than one by one.
///
/// In a packet every disc is tested with all rays, so the cost is the number of discs in the frustum: it grows with the
/// area of its far end. One by one, the cost is the number of rays. `cargo xtask bench cast` prints the speed for other
/// limits: it is flat around this one.
pub(crate) const SQUARES_PER_RAY: u32 = 4;
/// The overhead of a packet exceeds the cost of two single rays.
pub(crate) const LEAST_RAYS: u32 = 3;

/// Four planes around some rays, one beyond their ends and one before their starts: no ray meets anything outside of
/// any of them.
#[derive(Debug, Clone, Default)]
pub(crate) struct Frustum {
    planes: [Plane; 6],
    /// Width and height of the far end.
    far_extents_m: [f32; 2],
}

#[derive(Debug, Clone, Copy, Default)]
struct Plane {
    normal: [f32; 3],
    /// Inside: normal · x is at most this.
    at_most: f32,
    /// The same for centres of discs.
    at_most_for_centres: f32,
    /// The bounds of a box at its corner farthest inside.
    corner: [usize; 3],
}

impl Frustum {
    /// Around the rays of `lanes` (not empty) up to their `to_m`; `None` if they diverge too much.
    ///
    /// In a frame along the packet's axis (a; u and v across), a ray from depth A and offset U passes u = U + s (a −
    /// A), with slope s. From its start on, u − S a is at most U − S A for any S that is no less than every slope. The
    /// largest of these over all rays is a bounding plane, wherever each ray starts. The same holds for the smallest
    /// slope, and for v.
    #[inline(always)]
    pub(crate) fn around<S: Simd>(simd: S, rays: &PacketRays, lanes: u32, radius_m: f32) -> Option<Self> {
        let wide = simd.sixteen();
        let of = Within::<S> {
            mask: S::Sixteen::mask_of(wide, lanes),
            lowest: S::Sixteen::splat(wide, f32::NEG_INFINITY),
            highest: S::Sixteen::splat(wide, f32::INFINITY),
        };
        let origin = load3(simd, &rays.origin_m);
        let direction = load3(simd, &rays.direction);

        // The middle of the lanes, along the list of rays.
        let middle = nth_set(lanes, lanes.count_ones() / 2);
        let axis: [f32; 3] = rays.direction.map(|column| column[middle]);
        let [u, v] = across(axis);
        let axis_lanes = S::Sixteen::splat3(wide, axis);
        let along = dot(direction, axis_lanes);
        if of.smallest(along) < LEAST_COS {
            return None;
        }
        let depth = dot(origin, axis_lanes);
        let far = of.largest(depth + along * S::Sixteen::load(wide, &rays.to_m));
        let near = of.smallest(depth + along * S::Sixteen::load(wide, &rays.from_m));
        let inverse = S::Sixteen::splat(wide, 1.0) / along;
        let mut planes = [Plane::default(); 6];
        let mut far_extents_m = [0.0; 2];
        for (k, side) in [u, v].into_iter().enumerate() {
            let side_lanes = S::Sixteen::splat3(wide, side);
            let slope = dot(direction, side_lanes) * inverse;
            let offset = dot(origin, side_lanes);
            let (most, least) = (of.largest(slope), of.smallest(slope));
            let above = of.largest(offset - S::Sixteen::splat(wide, most) * depth);
            let below = of.smallest(offset - S::Sixteen::splat(wide, least) * depth);
            planes[2 * k] = Plane::new(sheared(side, -most, axis), above, radius_m);
            planes[2 * k + 1] = Plane::new(sheared(side, -least, axis).map(|c| -c), -below, radius_m);
            far_extents_m[k] = (above + most * far) - (below + least * far);
        }
        planes[4] = Plane::new(axis, far, radius_m);
        planes[5] = Plane::new(axis.map(|c| -c), -near, radius_m);
        Some(Self { planes, far_extents_m })
    }

    /// Whether the far end has at most this many squares of a disc's radius per ray.
    #[inline(always)]
    pub(crate) fn is_within(&self, squares_per_ray: u32, rays: u32, radius_m: f32) -> bool {
        let [width, height] = self.far_extents_m;
        width * height < squares_per_ray as f32 * rays as f32 * radius_m * radius_m
    }

    /// The children of a node that are at least partly inside. `BEYOND`: the rays do not begin near their origins,
    /// where the sides meet, so what lies before them is excluded too.
    #[inline(always)]
    pub(crate) fn children<S: Simd, const BEYOND: bool>(&self, simd: S, node: &Node) -> u32 {
        let [a, b, c, d, e, f] = &self.planes;
        let sides = a.boxes(simd, node) & b.boxes(simd, node) & c.boxes(simd, node) & d.boxes(simd, node);
        let mut inside = sides & e.boxes(simd, node);
        if BEYOND {
            inside = inside & f.boxes(simd, node);
        }
        inside.bits()
    }

    /// The discs of a leaf that may be inside, by their bounding spheres.
    #[inline(always)]
    pub(crate) fn discs<S: Simd, const BEYOND: bool>(&self, simd: S, leaf: &Leaf) -> u32 {
        let centre = columns(simd, leaf, 0);
        let [a, b, c, d, e, f] = &self.planes;
        let sides = a.centres(simd, centre)
            & b.centres(simd, centre)
            & c.centres(simd, centre)
            & d.centres(simd, centre);
        let mut inside = sides & e.centres(simd, centre);
        if BEYOND {
            inside = inside & f.centres(simd, centre);
        }
        inside.bits()
    }
}

/// Extremes over some lanes.
struct Within<S: Simd> {
    mask: <S::Sixteen as Lanes>::Mask,
    lowest: S::Sixteen,
    highest: S::Sixteen,
}

impl<S: Simd> Within<S> {
    #[inline(always)]
    fn largest(&self, values: S::Sixteen) -> f32 {
        values.where_or(self.mask, self.lowest).largest()
    }

    #[inline(always)]
    fn smallest(&self, values: S::Sixteen) -> f32 {
        values.where_or(self.mask, self.highest).smallest()
    }
}

#[inline(always)]
fn sheared(side: [f32; 3], slope: f32, axis: [f32; 3]) -> [f32; 3] {
    [side[0] + slope * axis[0], side[1] + slope * axis[1], side[2] + slope * axis[2]]
}

impl Plane {
    #[inline(always)]
    fn boxes<S: Simd>(&self, simd: S, node: &Node) -> <S::Eight as Lanes>::Mask {
        let eight = simd.eight();
        let corner = [
            S::Eight::load(eight, &node.bounds[self.corner[0]]),
            S::Eight::load(eight, &node.bounds[self.corner[1]]),
            S::Eight::load(eight, &node.bounds[self.corner[2]]),
        ];
        dot(corner, S::Eight::splat3(eight, self.normal)).le(S::Eight::splat(eight, self.at_most))
    }

    #[inline(always)]
    fn centres<S: Simd>(&self, simd: S, centre: [S::Sixteen; 3]) -> <S::Sixteen as Lanes>::Mask {
        let wide = simd.sixteen();
        let at_most = S::Sixteen::splat(wide, self.at_most_for_centres);
        dot(centre, S::Sixteen::splat3(wide, self.normal)).le(at_most)
    }

    #[inline(always)]
    fn new(normal: [f32; 3], at_most: f32, radius_m: f32) -> Self {
        // At least its length: (1 + x) / 2 is nowhere below √x, and near it for almost unit vectors.
        let length = 0.5 * (1.0 + normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
        let at_most = at_most + SLACK_M;
        Self {
            normal,
            at_most,
            at_most_for_centres: at_most + radius_m * length,
            corner: [0, 1, 2].map(|k| k + if normal[k] < 0.0 { 3 } else { 0 }),
        }
    }
}

/// Two unit vectors perpendicular to a unit vector and to each other, the first one level if possible.
#[inline(always)]
fn across(axis: [f32; 3]) -> [[f32; 3]; 2] {
    let [x, y, z] = axis;
    let level = (x * x + y * y).sqrt();
    if level < 1e-3 {
        // Straight up or down: the world's axes, minus their parts along it.
        let u = [1.0 - x * x, -x * y, -x * z];
        let v = [-y * x, 1.0 - y * y, -y * z];
        return [u, v];
    }
    let u = [-y / level, x / level, 0.0];
    [u, [-z * u[1], z * u[0], x * u[1] - y * u[0]]]
}

#[inline(always)]
fn nth_set(mut bits: u32, n: u32) -> usize {
    for _ in 0..n {
        bits &= bits - 1;
    }
    bits.trailing_zeros() as usize & 15
}
