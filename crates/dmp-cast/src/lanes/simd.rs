//! What a path of instructions can do: the traits that every kernel is written on.

use std::fmt::Debug;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Sub};

/// Proof that a path's instructions are there, and its vectors.
pub(crate) trait Simd: Copy + Debug {
    /// Eight lanes: the children of a node.
    type Eight: Lanes;
    /// Sixteen lanes: the discs of a leaf, or the rays of a packet.
    type Sixteen: Lanes;

    /// What eight lanes are made with.
    fn eight(self) -> <Self::Eight as Lanes>::Simd;
    /// What sixteen lanes are made with.
    fn sixteen(self) -> <Self::Sixteen as Lanes>::Simd;

    /// Runs a job in a function of its own that is compiled for this path.
    fn run<J: Job>(self, job: J) -> J::Output;
}

/// What is compiled for every path. Its `on` must be inlined, and what it calls, down to the vectors.
pub(crate) trait Job {
    /// What comes of it.
    type Output;
    /// Does it.
    fn on<S: Simd>(self, simd: S) -> Self::Output;
}

/// Lanes of a comparison.
pub(crate) trait Mask: Copy + BitAnd<Output = Self> + BitOr<Output = Self> {
    /// How many lanes.
    const COUNT: usize;

    /// A bit for each lane, the first lane lowest.
    fn bits(self) -> u32;
}

/// Numbers side by side. Slices must hold as many as there are lanes.
pub(crate) trait Lanes:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// What it is made with.
    type Simd: Copy;
    /// What comparisons give.
    type Mask: Mask;
    /// As many whole numbers.
    type Ints: Copy;
    /// How many.
    const COUNT: usize;

    /// The same in all lanes.
    fn splat(simd: Self::Simd, value: f32) -> Self;
    /// The first of `values`.
    fn load(simd: Self::Simd, values: &[f32]) -> Self;
    /// Writes the lanes to the front of `values`.
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
    /// Lanes of the first of `values` that are below `bound`.
    fn below(simd: Self::Simd, values: &[i32], bound: i32) -> Self::Mask;
    /// Lanes of the first of `values` that are above `bound`.
    fn above(simd: Self::Simd, values: &[i32], bound: i32) -> Self::Mask;
    /// The first of `values`, each `bits` further up, with `tag` in the bits below.
    fn tagged(simd: Self::Simd, values: &[u32], bits: u32, tag: u32) -> Self::Ints;
    /// Moves the lanes whose bit is set to the front of `packed`, in order; behind them `packed` may be overwritten,
    /// as far as there are lanes.
    fn pack(ints: Self::Ints, bits: u32, packed: &mut [u32]);
    /// Writes `first` plus the number of each lane whose bit is set to the front of `packed`, in order; behind them
    /// `packed` may be overwritten, as far as there are lanes.
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
