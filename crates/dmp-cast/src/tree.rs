use dmp_map::{Surfel, Tile, Weight};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;

/// Surfels a leaf may hold.
const LEAF_SURFELS: u32 = 16;
/// Slack around every disc's box, metres: rounding of the ray must not cull a disc it hits.
const BOX_SLACK_M: f32 = 1e-4;

/// One tile ready for casting: its surfels in the order of the leaves, and the boxes above them.
///
/// The tree is built by obvhs and copied out: its own traversal knows one nearest hit, not three answers,
/// ignores a ray's start and writes a hit distance even where there is no hit.
#[derive(Debug, Default)]
pub(crate) struct CastTile {
    pub(crate) origin_in_world_m: [f64; 3],
    pub(crate) radius_m: f32,
    pub(crate) surfels: Vec<Surfel>,
    /// The root first; an inner node's children beside each other.
    pub(crate) nodes: Vec<Node>,
}

/// A box with what is in it: surfels of a leaf, or two nodes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Node {
    pub(crate) min: [f32; 3],
    pub(crate) max: [f32; 3],
    /// First surfel of a leaf, or first of the two children.
    pub(crate) first: u32,
    /// Surfels of a leaf; 0 for an inner node.
    pub(crate) surfels: u32,
    /// Bounds of the support below: whether any surfel in here can be independent of a return.
    pub(crate) min_third_lowest: i32,
    pub(crate) max_third_highest: i32,
}

impl CastTile {
    /// Builds the tree. `O(n log n)`.
    pub(crate) fn new(tile: &Tile, radius_m: f32) -> Self {
        Self::numbered(tile, radius_m).0
    }

    /// The same, and for each surfel its place in `tile`.
    pub(crate) fn numbered(tile: &Tile, radius_m: f32) -> (Self, Vec<u32>) {
        let boxes: Vec<Aabb> = tile.surfels.iter().map(|s| box_of(s, radius_m)).collect();
        let params = BvhBuildParams { max_prims_per_leaf: LEAF_SURFELS, ..BvhBuildParams::very_fast_build() };
        let tree = build_bvh2(&boxes, params, &mut std::time::Duration::default());
        let surfels: Vec<Surfel> =
            tree.primitive_indices.iter().map(|&index| tile.surfels[index as usize]).collect();
        let nodes = copy_nodes(&tree, &surfels);
        (Self { origin_in_world_m: tile.origin_in_world_m, radius_m, surfels, nodes }, tree.primitive_indices)
    }
}

impl Weight for CastTile {
    fn weight_bytes(&self) -> usize {
        self.surfels.capacity() * size_of::<Surfel>() + self.nodes.capacity() * size_of::<Node>()
    }
}

fn box_of(surfel: &Surfel, radius_m: f32) -> Aabb {
    let half = surfel.half_extents_m(radius_m).map(|h| h + BOX_SLACK_M);
    let c = surfel.centre_in_tile_m;
    let corner = |sign: f32| std::array::from_fn::<f32, 3, _>(|k| c[k] + sign * half[k]);
    Aabb::new(corner(-1.0).into(), corner(1.0).into())
}

fn copy_nodes(tree: &Bvh2, surfels: &[Surfel]) -> Vec<Node> {
    let mut nodes: Vec<Node> = tree
        .nodes
        .iter()
        .map(|node| Node {
            min: node.aabb().min.to_array(),
            max: node.aabb().max.to_array(),
            first: node.first_index,
            surfels: node.prim_count,
            min_third_lowest: i32::MAX,
            max_third_highest: i32::MIN,
        })
        .collect();
    bound_support(&mut nodes, surfels, 0);
    nodes
}

/// Fills in the bounds of support below `root`: children before parents, without recursion.
fn bound_support(nodes: &mut [Node], surfels: &[Surfel], root: usize) {
    if nodes.is_empty() {
        return;
    }
    let mut order = vec![root];
    let mut at = 0;
    while let Some(&node) = order.get(at) {
        if nodes[node].surfels == 0 {
            let first = nodes[node].first as usize;
            order.extend([first, first + 1]);
        }
        at += 1;
    }
    for &node in order.iter().rev() {
        let Node { first, surfels: count, .. } = nodes[node];
        let first = first as usize;
        let (low, high) = if count == 0 {
            let [a, b] = [nodes[first], nodes[first + 1]];
            (a.min_third_lowest.min(b.min_third_lowest), a.max_third_highest.max(b.max_third_highest))
        } else {
            surfels[first..first + count as usize].iter().fold((i32::MAX, i32::MIN), |(low, high), s| {
                (low.min(s.third_lowest), high.max(s.third_highest))
            })
        };
        (nodes[node].min_third_lowest, nodes[node].max_third_highest) = (low, high);
    }
}
