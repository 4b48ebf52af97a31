use std::collections::HashMap;
use std::hash::BuildHasherDefault;

use crate::lattice::{Lattice, TileId, UNITS_PER_M, Voxel};
use crate::moments::{Moments, VoxelRecord};
use crate::normal::smallest_eigenvector;
use crate::tile_moments::MixHasher;

/// Points a voxel needs to become a surfel.
const MIN_VOXEL_POINTS: u64 = 3;
/// Points the surrounding 2 v cell needs to give a normal.
const MIN_CELL_POINTS: u64 = 5;
/// Squared lattice units: a cloud that does not spread in a second direction beyond its own rounding
/// (a line, or one point many times over) has no plane and no normal.
const MIN_SPREAD_UNITS2: f64 = 1.0;

/// A disc of the map, in tile-local metres: x and y from the tile's corner, z from the tile's
/// [`base_z_m`](crate::Tile::base_z_m). All discs of a map have the same radius.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surfel {
    /// Mean of the voxel's points.
    pub centre_in_tile_m: [f32; 3],
    /// Unit normal; its sign means nothing.
    pub normal: [f32; 3],
    /// See [`crate::Support::third_lowest`].
    pub third_lowest: i32,
    /// See [`crate::Support::third_highest`].
    pub third_highest: i32,
}

impl Surfel {
    /// Half extents of the disc's bounding box, metres.
    pub fn half_extents_m(&self, radius_m: f32) -> [f32; 3] {
        self.normal.map(|n| radius_m * (1.0 - n * n).max(0.0).sqrt())
    }
}

/// The surfels of one tile and the height their z counts from.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct TileSurfels {
    pub(crate) base_z_m: f64,
    pub(crate) surfels: Vec<Surfel>,
    /// Voxels that stayed below three points, had no normal, or no plane.
    pub(crate) thin_voxels: u64,
}

/// Surfels of a tile from its voxels in sorted order.
///
/// Centre: mean of the voxel's points. Normal: smallest eigenvector of the covariance of the points in
/// the 2 v cell around it. Cells never cross tiles, since a tile's edge is a multiple of 2 v.
pub(crate) fn surfels_of(lattice: &Lattice, voxels: &[VoxelRecord]) -> TileSurfels {
    let mut tile = TileSurfels::default();
    // From the middle of the tile's voxels, which a stray point far below does not move: f32 is precise
    // near where z counts from.
    let Some(middle) = voxels.get(voxels.len() / 2) else { return tile };
    let edge = lattice.voxel_units();
    let base_z = i64::from(middle.voxel().z) * i64::from(edge);
    tile.base_z_m = base_z as f64 / UNITS_PER_M;

    let mut cells: HashMap<Voxel, Moments, BuildHasherDefault<MixHasher>> = HashMap::default();
    for record in voxels {
        let (cell, shift) = cell_of(record.voxel(), edge);
        cells.entry(cell).or_default().merge_shifted(&record.moments, shift);
    }
    let mut normals: HashMap<Voxel, Option<[f32; 3]>, BuildHasherDefault<MixHasher>> = HashMap::default();
    for record in voxels {
        let (voxel, moments) = (record.voxel(), &record.moments);
        let cell = cell_of(voxel, edge).0;
        let normal = if moments.count < MIN_VOXEL_POINTS {
            None
        } else {
            *normals.entry(cell).or_insert_with(|| normal_of(&cells[&cell]))
        };
        let Some(normal) = normal else {
            tile.thin_voxels += 1;
            continue;
        };
        let corner = [
            i64::from(voxel.x) * i64::from(edge),
            i64::from(voxel.y) * i64::from(edge),
            i64::from(voxel.z) * i64::from(edge) - base_z,
        ];
        let mean = moments.mean_units();
        tile.surfels.push(Surfel {
            centre_in_tile_m: std::array::from_fn(|k| ((corner[k] as f64 + mean[k]) / UNITS_PER_M) as f32),
            normal,
            third_lowest: moments.support.third_lowest(),
            third_highest: moments.support.third_highest(),
        });
    }
    tile
}

fn cell_of(voxel: Voxel, edge_units: u32) -> (Voxel, [u64; 3]) {
    let odd = [u64::from(voxel.x & 1), u64::from(voxel.y & 1), u64::from(voxel.z as u32 & 1)];
    (Voxel { z: voxel.z >> 1, y: voxel.y >> 1, x: voxel.x >> 1 }, odd.map(|o| o * u64::from(edge_units)))
}

fn normal_of(cell: &Moments) -> Option<[f32; 3]> {
    if cell.count < MIN_CELL_POINTS {
        return None;
    }
    let (normal, eigenvalues) = smallest_eigenvector(cell.covariance_units2());
    (eigenvalues[1] > MIN_SPREAD_UNITS2).then_some(normal.map(|c| c as f32))
}

/// A surfel in world metres, on its way into the tile next door.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Border {
    pub(crate) centre_in_world_m: [f64; 3],
    pub(crate) surfel: Surfel,
    /// Its place among the surfels of the tile it comes from.
    pub(crate) index: usize,
}

/// Copies of the discs that reach over a border of `tile`, with the tile each reaches into.
pub(crate) fn borders_of(lattice: &Lattice, tile: TileId, content: &TileSurfels) -> Vec<(TileId, Border)> {
    // A little more than the disc, so that rounding at the border hides nothing.
    const MARGIN_M: f32 = 1e-3;
    let edge_m = lattice.tile_edge_m() as f32;
    let corner = lattice.tile_corner_m(tile);
    let radius_m = lattice.disc_radius_m() as f32;
    let mut copies = Vec::new();
    for (index, surfel) in content.surfels.iter().enumerate() {
        let half = surfel.half_extents_m(radius_m);
        let [x, y, z] = surfel.centre_in_tile_m;
        let steps = |centre: f32, half: f32| {
            let low = -i32::from(centre - half < MARGIN_M);
            let high = i32::from(centre + half > edge_m - MARGIN_M);
            low..=high
        };
        for dy in steps(y, half[1]) {
            for dx in steps(x, half[0]) {
                if (dx, dy) != (0, 0) {
                    let centre_in_world_m =
                        [corner[0] + f64::from(x), corner[1] + f64::from(y), content.base_z_m + f64::from(z)];
                    let neighbour = TileId { x: tile.x + dx, y: tile.y + dy };
                    copies.push((neighbour, Border { centre_in_world_m, surfel: *surfel, index }));
                }
            }
        }
    }
    copies
}

impl Border {
    pub(crate) fn in_tile(&self, lattice: &Lattice, tile: TileId, base_z_m: f64) -> Surfel {
        let corner = lattice.tile_corner_m(tile);
        let [x, y, z] = self.centre_in_world_m;
        let centre_in_tile_m = [(x - corner[0]) as f32, (y - corner[1]) as f32, (z - base_z_m) as f32];
        Surfel { centre_in_tile_m, ..self.surfel }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tile_moments::TileMoments;

    fn fuse(points: &[[f64; 3]]) -> (Lattice, TileSurfels) {
        let lattice = Lattice::new(0.2).unwrap();
        let mut tile = TileMoments::default();
        for &point in points {
            let p = lattice.locate(point).unwrap();
            tile.add(p.voxel, p.offset_units, Some(0));
        }
        let surfels = surfels_of(&lattice, &tile.into_sorted());
        (lattice, surfels)
    }

    #[test]
    fn a_tilted_plane_gives_its_normal_and_its_points() {
        let normal = nalgebra::Vector3::new(0.3, -0.2, 1.0).normalize();
        let height = |x: f64, y: f64| 7.0 - (normal.x * x + normal.y * y) / normal.z;
        let grid = |i: i32| f64::from(i) * 0.03 + 0.011;
        let points: Vec<_> = (0..300)
            .flat_map(|i| (0..300).map(move |j| (grid(i), grid(j))))
            .map(|(x, y)| [x, y, height(x, y)])
            .collect();
        let (_, tile) = fuse(&points);
        assert!(tile.surfels.len() > 1500);
        for surfel in &tile.surfels {
            let [x, y, z] = surfel.centre_in_tile_m.map(f64::from);
            let off = (z + tile.base_z_m - height(x, y)) * normal.z;
            assert!(off.abs() < 2e-4, "{off}");
            let cos = (0..3).map(|k| f64::from(surfel.normal[k]) * normal[k]).sum::<f64>().abs();
            assert!(cos > 1.0 - 1e-6, "{cos}");
        }
    }

    #[test]
    fn one_point_a_million_times_is_no_plane() {
        let (_, tile) = fuse(&vec![[3.21, 4.5, 6.0]; 1_000_000]);
        assert_eq!((tile.surfels.len(), tile.thin_voxels), (0, 1));
    }

    #[test]
    fn a_line_is_no_plane() {
        let line: Vec<_> = (0..100).map(|i| [3.0 + f64::from(i) * 0.01, 5.1, 1.1]).collect();
        assert_eq!(fuse(&line).1.surfels.len(), 0);
    }

    #[test]
    fn discs_on_a_border_go_to_every_tile_they_touch() {
        let lattice = Lattice::new(0.5).unwrap();
        let surfel = |x: f32, y: f32, normal: [f32; 3]| Surfel {
            centre_in_tile_m: [x, y, 1.0],
            normal,
            third_lowest: 0,
            third_highest: 0,
        };
        let flat = [0.0, 0.0, 1.0];
        let surfels = vec![
            surfel(16.0, 16.0, flat),           // none
            surfel(0.3, 16.0, flat),            // west
            surfel(0.3, 16.0, [1.0, 0.0, 0.0]), // a wall along the border: none
            surfel(31.8, 31.8, flat),           // east, north, north-east
        ];
        let content = TileSurfels { base_z_m: 100.0, surfels, thin_voxels: 0 };
        let copies = borders_of(&lattice, TileId { x: 4, y: -2 }, &content);
        let tiles: Vec<_> = copies.iter().map(|c| (c.0.x, c.0.y)).collect();
        assert_eq!(tiles, [(3, -2), (5, -2), (4, -1), (5, -1)]);
        let copied = copies[0].1.in_tile(&lattice, copies[0].0, 100.0);
        assert!((copied.centre_in_tile_m[0] - 32.3).abs() < 1e-4);
    }
}
