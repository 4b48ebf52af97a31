//! The crossing of a ray and a disc: one formula, for one ray and many discs as for many rays and one disc.

use super::tile::Leaf;
use crate::lanes::{Lanes, Simd, dot};

/// Least |n·d|: rays almost parallel to a disc do not cross it.
pub(crate) const MIN_COS: f32 = 0.01;
/// Three columns of a leaf, from `first` on.
#[inline(always)]
pub(crate) fn columns<S: Simd>(simd: S, leaf: &Leaf, first: usize) -> [S::Sixteen; 3] {
    [
        S::Sixteen::load(simd.sixteen(), &leaf.0[first]),
        S::Sixteen::load(simd.sixteen(), &leaf.0[first + 1]),
        S::Sixteen::load(simd.sixteen(), &leaf.0[first + 2]),
    ]
}

/// The crossing of rays with the planes of discs, the cosine of the incidence, and the squared distance from the disc's
/// centre.
#[inline(always)]
pub(crate) fn plane_crossing<L: Lanes>(o: [L; 3], d: [L; 3], c: [L; 3], n: [L; 3]) -> (L, L, L) {
    let to_centre = [c[0] - o[0], c[1] - o[1], c[2] - o[2]];
    let cos = dot(n, d);
    let range = dot(n, to_centre) / cos;
    let off = [range * d[0] - to_centre[0], range * d[1] - to_centre[1], range * d[2] - to_centre[2]];
    (range, cos, dot(off, off))
}
