//! Builds the BVH of a tile.

use dmp_map::{Surfel, Tile};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;

use super::tile::{CastTile, LEAF_DISCS, Leaf, LeafSupport, Node, WIDTH};

/// Slack around every disc's box, metres: rounding of the ray must not cull a disc it hits.
const BOX_SLACK_M: f32 = 1e-4;

impl CastTile {
    /// Builds the tree of a tile whose discs have one radius, metres. `O(n log n)`.
    pub fn build(tile: &Tile, radius_m: f32) -> Self {
        Self::numbered(tile, radius_m).0
    }

    /// The same, and for each disc of the leaves its index in `tile`: sixteen per leaf.
    ///
    /// obvhs clusters the discs into a binary tree. It is collapsed here to nodes eight wide and leaves as full as
    /// whole clusters allow. obvhs' own traversal is not used: it finds one nearest hit instead of three answers,
    /// ignores a ray's start and writes a hit distance even without a hit.
    pub(crate) fn numbered(tile: &Tile, radius_m: f32) -> (Self, Vec<u32>) {
        let surfels = &tile.surfels;
        let mut cast = Self { origin_in_world_m: tile.origin_in_world_m, radius_m, ..Self::default() };
        if surfels.is_empty() {
            return (cast, Vec::new());
        }
        let boxes: Vec<Aabb> = surfels.iter().map(|s| box_of(s, radius_m)).collect();
        let params = BvhBuildParams { max_prims_per_leaf: 1, ..BvhBuildParams::very_fast_build() };
        let tree = build_bvh2(&boxes, params, &mut std::time::Duration::default());
        drop(boxes);
        let clusters = Clusters::of(&tree);
        let mut collapse =
            Collapse { tree: &tree, clusters: &clusters, surfels, places: Vec::new(), cast: &mut cast };
        collapse.run();
        let places = collapse.places;
        cast.nodes.shrink_to_fit();
        cast.leaves.shrink_to_fit();
        cast.support.shrink_to_fit();
        (cast, places)
    }
}

fn box_of(surfel: &Surfel, radius_m: f32) -> Aabb {
    let half = surfel.half_extents_m(radius_m).map(|h| h + BOX_SLACK_M);
    let c = surfel.centre_in_tile_m;
    let corner = |sign: f32| std::array::from_fn::<f32, 3, _>(|k| c[k] + sign * half[k]);
    Aabb::new(corner(-1.0).into(), corner(1.0).into())
}

/// Number of discs below each node of the binary tree.
struct Clusters {
    discs: Vec<u32>,
}

impl Clusters {
    fn of(tree: &Bvh2) -> Self {
        let mut discs = vec![0; tree.nodes.len()];
        // Parents precede children, so reversed, children come first; no recursion.
        let mut order = Vec::with_capacity(tree.nodes.len());
        order.push(0);
        let mut at = 0;
        while let Some(&node) = order.get(at) {
            let node: &obvhs::bvh2::node::Bvh2Node = &tree.nodes[node as usize];
            if !node.is_leaf() {
                order.extend([node.first_index, node.first_index + 1]);
            }
            at += 1;
        }
        for &index in order.iter().rev() {
            let node = &tree.nodes[index as usize];
            let first = node.first_index as usize;
            discs[index as usize] =
                if node.is_leaf() { node.prim_count } else { discs[first] + discs[first + 1] };
        }
        Self { discs }
    }
}

struct Collapse<'a> {
    tree: &'a Bvh2,
    clusters: &'a Clusters,
    surfels: &'a [Surfel],
    places: Vec<u32>,
    cast: &'a mut CastTile,
}

impl Collapse<'_> {
    /// Fills nodes and leaves, depth first, so that neighbours in space are neighbours in memory.
    fn run(&mut self) {
        self.cast.nodes.push(Node::EMPTY);
        // A node to fill, and its node of the binary tree.
        let mut open = vec![(0usize, 0u32)];
        while let Some((index, binary)) = open.pop() {
            let (children, count) = self.widen(binary);
            let mut inner = [(0, 0); WIDTH];
            let mut inners = 0;
            for (place, &child) in children[..count].iter().enumerate() {
                let aabb = *self.tree.nodes[child as usize].aabb();
                let (min, max) = (aabb.min.to_array(), aabb.max.to_array());
                let is_leaf = self.is_leaf(child);
                let reference = if is_leaf {
                    self.leaf(child)
                } else {
                    let node = self.cast.nodes.len();
                    self.cast.nodes.push(Node::EMPTY);
                    inner[inners] = (node, child);
                    inners += 1;
                    node
                };
                let node = &mut self.cast.nodes[index];
                node.leaves |= u32::from(is_leaf) << place;
                for k in 0..3 {
                    (node.bounds[k][place], node.bounds[3 + k][place]) = (min[k], max[k]);
                }
                node.children[place] = reference as u32;
            }
            open.extend(inner[..inners].iter().rev());
        }
        self.bound_support();
    }

    /// Up to eight clusters below a binary node: the one with the largest surface is split first.
    fn widen(&self, binary: u32) -> ([u32; WIDTH], usize) {
        let mut children = [binary; WIDTH];
        let mut count = 1;
        while count < WIDTH {
            let area = |&(_, &child): &(usize, &u32)| self.tree.nodes[child as usize].aabb().half_area();
            let largest = children[..count]
                .iter()
                .enumerate()
                .filter(|(_, child)| !self.is_leaf(**child))
                .max_by(|a, b| area(a).total_cmp(&area(b)));
            let Some((place, &child)) = largest else { break };
            let first = self.tree.nodes[child as usize].first_index;
            (children[place], children[count]) = (first, first + 1);
            count += 1;
        }
        (children, count)
    }

    fn is_leaf(&self, binary: u32) -> bool {
        self.clusters.discs[binary as usize] as usize <= LEAF_DISCS
            || self.tree.nodes[binary as usize].is_leaf()
    }

    fn leaf(&mut self, binary: u32) -> usize {
        let (mut leaf, mut support) = (Leaf::EMPTY, LeafSupport::EMPTY);
        let (mut open, mut count) = (vec![binary], 0);
        self.places.resize(self.places.len() + LEAF_DISCS, u32::MAX);
        let places = self.places.len() - LEAF_DISCS;
        while let Some(index) = open.pop() {
            let node = &self.tree.nodes[index as usize];
            let below = node.first_index as usize;
            if !node.is_leaf() {
                open.extend([node.first_index + 1, node.first_index]);
                continue;
            }
            for &place in &self.tree.primitive_indices[below..below + node.prim_count as usize] {
                let surfel = &self.surfels[place as usize];
                for k in 0..3 {
                    leaf.0[k][count] = surfel.centre_in_tile_m[k];
                    leaf.0[3 + k][count] = surfel.normal[k];
                }
                support.third_lowest[count] = surfel.third_lowest;
                support.third_highest[count] = surfel.third_highest;
                self.places[places + count] = place;
                count += 1;
            }
        }
        self.cast.leaves.push(leaf);
        self.cast.support.push(support);
        self.cast.leaves.len() - 1
    }

    /// Children follow their parents, so reversed, they come first.
    fn bound_support(&mut self) {
        for index in (0..self.cast.nodes.len()).rev() {
            for place in 0..WIDTH {
                let node = &self.cast.nodes[index];
                if !node.holds(place) {
                    continue;
                }
                let child = node.children[place] as usize;
                let (lows, highs): (&[i32], &[i32]) = if node.leaves >> place & 1 == 1 {
                    let support = &self.cast.support[child];
                    (&support.third_lowest, &support.third_highest)
                } else {
                    let child = &self.cast.nodes[child];
                    (&child.min_third_lowest, &child.max_third_highest)
                };
                let low = lows.iter().fold(i32::MAX, |a, &b| a.min(b));
                let high = highs.iter().fold(i32::MIN, |a, &b| a.max(b));
                let node = &mut self.cast.nodes[index];
                (node.min_third_lowest[place], node.max_third_highest[place]) = (low, high);
            }
        }
    }
}
