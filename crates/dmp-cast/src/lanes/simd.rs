//! The traits of an instruction path, on which every kernel is written.

use std::fmt::Debug;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Sub};

/// Proof that a path's instructions are available, and its vectors.
pub(crate) trait Simd: Copy + Debug {
    /// Eight lanes: the children of a node.
    type Eight: Lanes;
    /// Sixteen lanes: the discs of a leaf, or the rays of a packet.
    type Sixteen: Lanes;

    /// The token that makes eight lanes.
    fn eight(self) -> <Self::Eight as Lanes>::Simd;
    /// The token that makes sixteen lanes.
    fn sixteen(self) -> <Self::Sixteen as Lanes>::Simd;

    /// Runs a job in a function compiled for this path.
    fn run<J: Job>(self, job: J) -> J::Output;
}

/// Code compiled for every path. Its `on` must be inlined, and everything it calls, down to the vectors.
pub(crate) trait Job {
    /// The result.
    type Output;
    /// Runs it.
    fn on<S: Simd>(self, simd: S) -> Self::Output;
}

/// The lanes of a comparison.
pub(crate) trait Mask: Copy + BitAnd<Output = Self> + BitOr<Output = Self> {
    /// Number of lanes.
    const COUNT: usize;

    /// A bit for each lane, the first lane lowest.
    fn bits(self) -> u32;
}

/// A vector of numbers. Slices must have at least as many elements as lanes.
pub(crate) trait Lanes:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// The token that makes it.
    type Simd: Copy;
    /// The result of comparisons.
    type Mask: Mask;
    /// The same number of integers.
    type Ints: Copy;
    /// Number of lanes.
    const COUNT: usize;

    /// One value in all lanes.
    fn splat(simd: Self::Simd, value: f32) -> Self;
    /// The first elements of `values`.
    fn load(simd: Self::Simd, values: &[f32]) -> Self;
    /// Writes the lanes to the start of `values`.
    fn store(self, values: &mut [f32]);
    /// `self` where smaller, else `other`.
    fn min(self, other: Self) -> Self;
    /// `self` where larger, else `other`.
    fn max(self, other: Self) -> Self;
    /// Without the sign.
    fn abs(self) -> Self;
    /// Lanes of `self < other`.
    fn lt(self, other: Self) -> Self::Mask;
    /// Lanes of `self <= other`.
    fn le(self, other: Self) -> Self::Mask;
    /// Lanes of `self == other`.
    fn equal(self, other: Self) -> Self::Mask;
    /// `self` in the lanes of `mask`, else `other`.
    fn where_or(self, mask: Self::Mask, other: Self) -> Self;
    /// Lanes whose bit is set.
    fn mask_of(simd: Self::Simd, bits: u32) -> Self::Mask;
    /// Lanes where the first elements of `values` are below `bound`.
    fn below(simd: Self::Simd, values: &[i32], bound: i32) -> Self::Mask;
    /// Lanes where the first elements of `values` are above `bound`.
    fn above(simd: Self::Simd, values: &[i32], bound: i32) -> Self::Mask;
    /// The first elements of `values`, each shifted up by `bits`, with `tag` in the bits below.
    fn tagged(simd: Self::Simd, values: &[u32], bits: u32, tag: u32) -> Self::Ints;
    /// Moves the lanes whose bit is set to the start of `packed`, in order. The elements behind them may be
    /// overwritten, up to the number of lanes.
    fn pack(ints: Self::Ints, bits: u32, packed: &mut [u32]);
    /// Writes `first` plus the index of each lane whose bit is set to the start of `packed`, in order. The elements
    /// behind them may be overwritten, up to the number of lanes.
    fn pack_lanes(simd: Self::Simd, first: u32, bits: u32, packed: &mut [u32]);
    /// The smallest lane.
    fn smallest(self) -> f32;
    /// The largest lane.
    fn largest(self) -> f32;

    /// A vector in all lanes.
    #[inline(always)]
    fn splat3(simd: Self::Simd, v: [f32; 3]) -> [Self; 3] {
        [Self::splat(simd, v[0]), Self::splat(simd, v[1]), Self::splat(simd, v[2])]
    }
}

/// a · b, lane by lane.
#[inline(always)]
pub(crate) fn dot<L: Lanes>(a: [L; 3], b: [L; 3]) -> L {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
