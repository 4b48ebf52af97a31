//! Computes surfels from voxel sums: those of a tile, and the copies that reach over its borders.

use std::borrow::Borrow;
use std::collections::BTreeMap;

use dmp_disk::TileId;

use super::code::{Decoder, NormalCode, SurfelCode};
use super::normal::smallest_eigenvector;
use super::surfel::Surfel;
use crate::grid::{Lattice, VOXEL_OF_CELL_BITS};
use crate::voxels::{Moments, VoxelRecord};

/// Points a voxel needs to become a surfel.
const MIN_VOXEL_POINTS: u64 = 3;
/// Points that the surrounding 2 v cell needs for a normal.
const MIN_CELL_POINTS: u64 = 5;
/// Squared lattice units: a cloud whose second direction spreads no more than its rounding (a line, or one repeated
/// point) has no plane and no normal.
const MIN_SPREAD_UNITS2: f64 = 1.0;

/// The surfels of one tile and the origin of their z.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct TileSurfels {
    /// z of the voxels on whose lower faces z is 0.
    pub(crate) base_voxel_z: i32,
    pub(crate) codes: Vec<SurfelCode>,
    /// Those that the map leaves out.
    pub(crate) left_out: Vec<SurfelCode>,
    /// Voxels with fewer than three points, no normal, or no plane.
    pub(crate) thin_voxels: u64,
}

impl TileSurfels {
    /// The surfels, in the order of their codes.
    pub(crate) fn surfels(&self, lattice: &Lattice) -> impl Iterator<Item = Surfel> {
        let mut decoder = Decoder::new(lattice, self.base_voxel_z);
        self.codes.iter().map(move |code| decoder.surfel(code))
    }
}

/// Computes the surfels of a tile from its voxels [by their cells](crate::grid::Voxel::by_cell).
///
/// # Errors
/// The first error among the voxels.
pub(crate) fn surfels_of<E>(
    lattice: &Lattice,
    voxels: impl Iterator<Item = Result<VoxelRecord, E>>,
) -> Result<TileSurfels, E> {
    let mut heights: BTreeMap<i32, u64> = BTreeMap::new();
    let mut failed = None;
    let voxels = voxels.map_while(|voxel| voxel.map_err(|error| failed = Some(error)).ok());
    let voxels = voxels.inspect(|record| *heights.entry(record.voxel().z).or_default() += 1);
    let tile = surfels_of_cells(lattice, voxels);
    match failed {
        Some(error) => Err(error),
        None => Ok(TileSurfels { base_voxel_z: middle_of(&heights), ..tile }),
    }
}

/// The median of counted numbers, 0 without any.
fn middle_of(counts: &BTreeMap<i32, u64>) -> i32 {
    let mut left = counts.values().sum::<u64>() / 2;
    let is_there = |&(_, &count): &(&i32, &u64)| {
        let there = left < count;
        left = left.saturating_sub(count);
        there
    };
    counts.iter().find(is_there).map_or(0, |(&number, _)| number)
}

/// Computes the surfels of voxels, those of a cell consecutive, in the order of the voxels.
///
/// Centre: mean of the voxel's points. Normal: smallest eigenvector of the covariance of the points in the surrounding
/// 2 v cell. Cells never cross tiles, since a tile's edge is a multiple of 2 v. Both are rounded.
pub(crate) fn surfels_of_cells<V: Borrow<VoxelRecord>>(
    lattice: &Lattice,
    voxels: impl IntoIterator<Item = V>,
) -> TileSurfels {
    let mut tile = TileSurfels::default();
    let edge = lattice.voxel_units();
    let mut voxels = voxels.into_iter().peekable();
    let mut cell: Vec<V> = Vec::with_capacity(8);
    while let Some(first) = voxels.next() {
        let place = cell_of(first.borrow());
        cell.clear();
        cell.push(first);
        while let Some(other) = voxels.next_if(|other| cell_of(other.borrow()) == place) {
            cell.push(other);
        }
        let normal = normal_of(&cell, edge).map(NormalCode::of);
        for record in cell.iter().map(V::borrow) {
            let moments = &record.moments;
            let Some(normal) = normal.filter(|_| moments.count >= MIN_VOXEL_POINTS) else {
                tile.thin_voxels += 1;
                continue;
            };
            let voxel = record.voxel();
            let place = [i32::from(voxel.x), i32::from(voxel.y), voxel.z];
            tile.codes.push(SurfelCode {
                third_lowest: moments.support.third_lowest(),
                third_highest: moments.support.third_highest(),
                ..SurfelCode::of(lattice, place, normal, moments.mean_units())
            });
        }
    }
    tile
}

fn cell_of(record: &VoxelRecord) -> u64 {
    record.voxel().by_cell() >> VOXEL_OF_CELL_BITS
}

fn normal_of<V: Borrow<VoxelRecord>>(cell: &[V], edge_units: u32) -> Option<[f64; 3]> {
    let cell = cell.iter().map(V::borrow);
    // The common case: too few points for any surfel.
    if cell.clone().all(|record| record.moments.count < MIN_VOXEL_POINTS) {
        return None;
    }
    let mut all = Moments::default();
    for record in cell {
        let voxel = record.voxel();
        let odd = [i64::from(voxel.x & 1), i64::from(voxel.y & 1), i64::from(voxel.z & 1)];
        all.merge_shifted(&record.moments, odd.map(|odd| odd * i64::from(edge_units)));
    }
    if all.count < MIN_CELL_POINTS {
        return None;
    }
    let (normal, eigenvalues) = smallest_eigenvector(all.covariance_units2());
    (eigenvalues[1] > MIN_SPREAD_UNITS2).then_some(normal)
}

/// Copies of the discs that reach over a border of `tile`, with the tile each reaches into and relative to that tile.
pub(crate) fn borders_of(
    lattice: &Lattice,
    tile: TileId,
    content: &TileSurfels,
) -> Vec<(TileId, SurfelCode)> {
    // A little more than the disc, so that rounding at the border loses nothing.
    const MARGIN_M: f32 = 1e-3;
    let edge_m = lattice.tile_edge_m() as f32;
    let edge_voxels = lattice.tile_voxels() as i32;
    let radius_m = lattice.disc_radius_m() as f32;
    let mut copies = Vec::new();
    for (code, surfel) in content.codes.iter().zip(content.surfels(lattice)) {
        let half = surfel.half_extents_m(radius_m);
        let [x, y, _] = surfel.centre_in_tile_m;
        let steps = |centre: f32, half: f32| {
            let low = -i32::from(centre - half < MARGIN_M);
            let high = i32::from(centre + half > edge_m - MARGIN_M);
            low..=high
        };
        for dy in steps(y, half[1]) {
            for dx in steps(x, half[0]) {
                if (dx, dy) != (0, 0) {
                    let [x, y, z] = code.voxel;
                    let voxel = [x - dx * edge_voxels, y - dy * edge_voxels, z];
                    let neighbour = TileId { x: tile.x + dx, y: tile.y + dy };
                    copies.push((neighbour, SurfelCode { voxel, ..*code }));
                }
            }
        }
    }
    copies
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::UNITS_PER_M;
    use crate::voxels::{PackedSums, PartOfVoxel, TileMoments};

    fn fuse(points: &[[f64; 3]]) -> (Lattice, TileSurfels) {
        let lattice = Lattice::new(0.2).unwrap();
        let mut tile = TileMoments::default();
        for &point in points {
            let (voxel, mut sums) = (lattice.locate(point).unwrap().1, PackedSums::default());
            sums.add_point(lattice.in_voxel(point).unwrap().offset_units);
            tile.add(&[PartOfVoxel { voxel, sums }], Some(0));
        }
        let surfels = surfels_of::<()>(&lattice, tile.into_records().map(Ok)).unwrap();
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
        let (lattice, tile) = fuse(&points);
        assert!(tile.codes.len() > 1500);
        let base_z_m = f64::from(tile.base_voxel_z) * lattice.voxel_m();
        for surfel in tile.surfels(&lattice) {
            let [x, y, z] = surfel.centre_in_tile_m.map(f64::from);
            let off = (z + base_z_m - height(x, y)) * normal.z;
            assert!(off.abs() < 2e-4, "{off}");
            let cos = (0..3).map(|k| f64::from(surfel.normal[k]) * normal[k]).sum::<f64>().abs();
            assert!(cos > 1.0 - 1e-6, "{cos}");
        }
    }

    #[test]
    fn one_point_a_million_times_is_no_plane() {
        let (_, tile) = fuse(&vec![[3.21, 4.5, 6.0]; 1_000_000]);
        assert_eq!((tile.codes.len(), tile.thin_voxels), (0, 1));
    }

    #[test]
    fn a_line_is_no_plane() {
        let line: Vec<_> = (0..100).map(|i| [3.0 + f64::from(i) * 0.01, 5.1, 1.1]).collect();
        assert_eq!(fuse(&line).1.codes.len(), 0);
    }

    #[test]
    fn discs_on_a_border_go_to_every_tile_they_touch() {
        let lattice = Lattice::new(0.5).unwrap();
        let code = |x: f64, y: f64, normal: [f64; 3]| {
            let units = [x, y, 1.0].map(|c| c * UNITS_PER_M);
            let edge = f64::from(lattice.voxel_units());
            let voxel = units.map(|c| (c / edge).floor());
            let inside = std::array::from_fn(|k| units[k] - voxel[k] * edge);
            SurfelCode::of(&lattice, voxel.map(|v| v as i32), NormalCode::of(normal), inside)
        };
        let flat = [0.0, 0.0, 1.0];
        let codes = vec![
            code(16.0, 16.0, flat),           // none
            code(0.3, 16.0, flat),            // west
            code(0.3, 16.0, [1.0, 0.0, 0.0]), // a wall along the border: none
            code(31.8, 31.8, flat),           // east, north, north-east
        ];
        let content = TileSurfels { base_voxel_z: 2, codes, ..TileSurfels::default() };
        let copies = borders_of(&lattice, TileId { x: 4, y: -2 }, &content);
        let tiles: Vec<_> = copies.iter().map(|c| (c.0.x, c.0.y)).collect();
        assert_eq!(tiles, [(3, -2), (5, -2), (4, -1), (5, -1)]);
        let there = TileSurfels { codes: copies.iter().map(|c| c.1).collect(), ..content };
        let centres: Vec<_> = there.surfels(&lattice).map(|s| s.centre_in_tile_m).collect();
        let expected = [[32.3, 16.0, 0.0], [-0.2, 31.8, 0.0], [31.8, -0.2, 0.0], [-0.2, -0.2, 0.0]];
        for (centre, expected) in centres.iter().zip(expected) {
            assert!((0..3).all(|k| (f64::from(centre[k]) - expected[k]).abs() < 1e-4), "{centres:?}");
        }
    }
}
