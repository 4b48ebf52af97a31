//! A tile prepared for casting: a tree with leaves of discs.

use dmp_disk::Weight;
use dmp_map::Independence;

use crate::lanes::{Lanes, Simd};

/// Children of a node.
pub(crate) const WIDTH: usize = 8;
/// Most discs of a leaf.
pub(crate) const LEAF_DISCS: usize = 16;

/// One tile prepared for casting: a tree eight wide with leaves of up to sixteen discs.
#[derive(Debug, Default)]
pub struct CastTile {
    pub(crate) origin_in_world_m: [f64; 3],
    pub(crate) radius_m: f32,
    /// The root first, parents before their children.
    pub(crate) nodes: Vec<Node>,
    pub(crate) leaves: Vec<Leaf>,
    /// The segments that saw the discs of each leaf.
    pub(crate) support: Vec<LeafSupport>,
}

/// A [`CastTile`] for the kernels: slices that need no further indirection.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TileView<'a> {
    pub(crate) origin_in_world_m: [f64; 3],
    pub(crate) radius_m: f32,
    pub(crate) nodes: &'a [Node],
    pub(crate) leaves: &'a [Leaf],
    pub(crate) support: &'a [LeafSupport],
}

impl CastTile {
    pub(crate) fn view(&self) -> TileView<'_> {
        let Self { origin_in_world_m, radius_m, nodes, leaves, support } = self;
        TileView { origin_in_world_m: *origin_in_world_m, radius_m: *radius_m, nodes, leaves, support }
    }
}

/// Eight boxes and their content. An unused place has a box that no ray meets.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct Node {
    /// Least x, y and z, then largest, of each child, metres from the tile's origin.
    pub(crate) bounds: [[f32; WIDTH]; 6],
    /// Minimum over everything below each child: no surfel there is independent of an earlier segment.
    pub(crate) min_third_lowest: [i32; WIDTH],
    /// Maximum likewise, for a later segment.
    pub(crate) max_third_highest: [i32; WIDTH],
    /// Indices of nodes or leaves.
    pub(crate) children: [u32; WIDTH],
    /// A bit for each child that is a leaf.
    pub(crate) leaves: u32,
}

/// Sixteen discs in columns, one component of all of them per cache line: centre x, y, z (metres from the tile's
/// origin), normal x, y, z. An unused place has a zero normal, so that no ray crosses it, and a distant centre.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct Leaf(pub(crate) [[f32; LEAF_DISCS]; 6]);

/// Third lowest and third highest segments of sixteen discs.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct LeafSupport {
    pub(crate) third_lowest: [i32; LEAF_DISCS],
    pub(crate) third_highest: [i32; LEAF_DISCS],
}

impl Node {
    pub(crate) const EMPTY: Self = {
        // Finite, so that no product with it is NaN.
        let (low, high) = ([1e30; WIDTH], [-1e30; WIDTH]);
        Self {
            bounds: [low, low, low, high, high, high],
            min_third_lowest: [i32::MAX; WIDTH],
            max_third_highest: [i32::MIN; WIDTH],
            children: [0; WIDTH],
            leaves: 0,
        }
    };

    pub(crate) fn holds(&self, place: usize) -> bool {
        self.bounds[0][place] <= self.bounds[3][place]
    }

    /// The children that may have an independent surfel.
    #[inline(always)]
    pub(crate) fn may_hold<S: Simd>(&self, simd: S, independence: Independence) -> <S::Eight as Lanes>::Mask {
        let [below, above] = independence.bounds();
        S::Eight::below(simd.eight(), &self.min_third_lowest, below)
            | S::Eight::above(simd.eight(), &self.max_third_highest, above)
    }
}

impl Leaf {
    pub(crate) const EMPTY: Self = {
        let (far, none) = ([1e15; LEAF_DISCS], [0.0; LEAF_DISCS]);
        Self([far, far, far, none, none, none])
    };

    /// Three numbers of one disc, from `first` on: 0 for its centre, 3 for its normal.
    #[inline(always)]
    pub(crate) fn disc(&self, disc: usize, first: usize) -> [f32; 3] {
        let disc = disc % LEAF_DISCS;
        [self.0[first][disc], self.0[first + 1][disc], self.0[first + 2][disc]]
    }
}

impl LeafSupport {
    pub(crate) const EMPTY: Self =
        Self { third_lowest: [i32::MAX; LEAF_DISCS], third_highest: [i32::MIN; LEAF_DISCS] };

    #[inline(always)]
    pub(crate) fn of(&self, disc: usize) -> [i32; 2] {
        [self.third_lowest[disc % LEAF_DISCS], self.third_highest[disc % LEAF_DISCS]]
    }
}

impl Weight for CastTile {
    fn weight_bytes(&self) -> usize {
        self.nodes.capacity() * size_of::<Node>()
            + self.leaves.capacity() * size_of::<Leaf>()
            + self.support.capacity() * size_of::<LeafSupport>()
    }
}
