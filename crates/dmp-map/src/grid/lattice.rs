//! The integer grid of maps: units, voxels, tiles.

use dmp_disk::TileId;

use super::integers::{Reciprocal, rounded};
use crate::MapError;

/// Lattice units per metre: coordinates are rounded to 2⁻¹³ m (0.12 mm) before anything is summed.
pub const UNITS_PER_M: f64 = 8192.0;
/// Steps of depth in a lattice unit: 3.8 µm each.
pub(crate) const DEPTH_STEPS: u32 = 32;
/// Every map rejects coordinates beyond this, metres. Earth-centred coordinates (6.4e6 m) are well inside for all but
/// the smallest voxels.
pub(crate) const WORLD_LIMIT_M: f64 = 5e7;
/// Smallest and largest voxel edge, metres.
const SMALLEST_M: f64 = 0.01;
const LARGEST_M: f64 = 2.0;
/// The tile edge is the multiple of 2 v nearest to this, metres.
const TILE_EDGE_M: f64 = 32.0;
/// Smaller voxels are for rooms, metres: with tiles of the usual edge, a tile would be a whole room.
const ROOM_VOXELS_M: f64 = 0.05;
/// The edge of tiles with such voxels.
const ROOM_TILE_VOXELS: u32 = 160;

/// The integer grid of every map: lattice units, voxels of a whole number of units, tiles of a whole, even number of
/// voxels. All indices follow from integers alone, so they are equal on every machine and for every reading order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Lattice {
    voxel_units: u32,
    tile_voxels: u32,
    by_voxel: Reciprocal,
    by_tile: Reciprocal,
}

/// Bits of [`Voxel::by_cell`] that distinguish the voxels of a cell.
pub(crate) const VOXEL_OF_CELL_BITS: u32 = 3;

/// A point on the lattice: its voxel and its offset in it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct InVoxel {
    /// In voxels from the origin of units.
    pub(crate) voxel: [u32; 3],
    /// Offset from the voxel's lowest corner, lattice units, each below `voxel_units` and 2¹⁴.
    pub(crate) offset_units: [u16; 3],
}

/// A voxel of a tile: x and y counted from the tile's corner, z from world zero.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct Voxel {
    pub(crate) z: i32,
    pub(crate) y: u16,
    pub(crate) x: u16,
}

impl Voxel {
    /// Its index among the voxels of a tile, ordered by their 2 v cells (z, y, x) and then by the voxel in the cell.
    /// Voxels of a cell differ in the last [`VOXEL_OF_CELL_BITS`].
    pub(crate) fn by_cell(self) -> u64 {
        let z = u64::from(self.z as u32 ^ 1 << 31);
        let (y, x) = (u64::from(self.y), u64::from(self.x));
        let cell = (z >> 1) << 30 | (y >> 1) << 15 | x >> 1;
        cell << VOXEL_OF_CELL_BITS | (z & 1) << 2 | (y & 1) << 1 | x & 1
    }

    /// The voxel with the index `by_cell`.
    pub(crate) fn at(by_cell: u64) -> Self {
        let (cell, low) = (by_cell >> VOXEL_OF_CELL_BITS, by_cell as u32);
        let z = (cell >> 30) as u32 & (u32::MAX >> 1);
        let [y, x] = [cell >> 15, cell].map(|c| (c & 0x7fff) as u16);
        let [z_bit, y_bit, x_bit] = [low >> 2 & 1, low >> 1 & 1, low & 1];
        Self { z: ((z << 1 | z_bit) ^ 1 << 31) as i32, y: y << 1 | y_bit as u16, x: x << 1 | x_bit as u16 }
    }
}

impl Lattice {
    /// The lattice with voxels of `voxel_m`, rounded to the nearest unit (0.2 m becomes 0.19995 m).
    ///
    /// # Errors
    /// Outside 0.01 to 2 m, where the exact sums and indices are not guaranteed.
    pub fn new(voxel_m: f64) -> Result<Self, MapError> {
        if !(SMALLEST_M..=LARGEST_M).contains(&voxel_m) {
            return Err(MapError::VoxelOutOfRange { voxel_m });
        }
        let voxel_units = (voxel_m * UNITS_PER_M).round() as u32;
        let cells = (TILE_EDGE_M * UNITS_PER_M / f64::from(2 * voxel_units)).round() as u32;
        let is_for_rooms = f64::from(voxel_units) < (ROOM_VOXELS_M * UNITS_PER_M).round();
        let tile_voxels = if is_for_rooms { ROOM_TILE_VOXELS } else { 2 * cells };
        let (by_voxel, by_tile) = (Reciprocal::of(voxel_units), Reciprocal::of(tile_voxels));
        Ok(Self { voxel_units, tile_voxels, by_voxel, by_tile })
    }

    pub(crate) fn from_parts(voxel_units: u32, tile_voxels: u32) -> Option<Self> {
        let lattice = Self::new(f64::from(voxel_units) / UNITS_PER_M).ok()?;
        (lattice.voxel_units == voxel_units && lattice.tile_voxels == tile_voxels).then_some(lattice)
    }

    pub(crate) fn voxel_units(&self) -> u32 {
        self.voxel_units
    }

    pub(crate) fn tile_voxels(&self) -> u32 {
        self.tile_voxels
    }

    /// Steps per lattice unit to which centres of surfels are rounded within their discs. It is a power of two, so that
    /// a voxel has up to 2¹³ steps, at least one per unit, and never finer than those of depth.
    pub(crate) fn across_steps(&self) -> u32 {
        1 << ((1 << 13) / self.voxel_units).clamp(1, DEPTH_STEPS).ilog2()
    }

    /// Voxel edge v, metres.
    pub fn voxel_m(&self) -> f64 {
        f64::from(self.voxel_units) / UNITS_PER_M
    }

    /// Tile edge, metres.
    pub fn tile_edge_m(&self) -> f64 {
        self.voxel_m() * f64::from(self.tile_voxels)
    }

    /// Radius of every surfel's disc: 0.8 v, metres.
    pub fn disc_radius_m(&self) -> f64 {
        0.8 * self.voxel_m()
    }

    /// Coordinates beyond this are rejected, metres: 5e7 m. With voxels below 0.05 m it is nine tenths of the reach of
    /// 2²¹ tiles: 3e6 m for voxels of 0.01 m.
    #[inline]
    pub fn world_limit_m(&self) -> f64 {
        WORLD_LIMIT_M.min(0.9 * f64::from(ORIGIN_TILES) * self.tile_edge_m())
    }

    /// The tile of a position in the world, metres.
    ///
    /// # Errors
    /// When the position is not finite or outside [`Self::world_limit_m`].
    #[inline]
    pub fn tile_of(&self, point_in_world_m: [f64; 3]) -> Result<TileId, MapError> {
        Ok(self.locate(point_in_world_m)?.0)
    }

    /// Corner of a tile with the smallest x and y, world metres.
    pub fn tile_corner_m(&self, tile: TileId) -> [f64; 2] {
        [f64::from(tile.x) * self.tile_edge_m(), f64::from(tile.y) * self.tile_edge_m()]
    }

    /// The tile of a point, and the point's voxel in it.
    ///
    /// # Errors
    /// When the point is not finite or outside [`Self::world_limit_m`].
    #[inline]
    pub(crate) fn locate(&self, point_in_world_m: [f64; 3]) -> Result<(TileId, Voxel), MapError> {
        Ok(self.in_tile(self.in_voxel(point_in_world_m)?.voxel))
    }

    /// The voxel of a point, and its offset in it.
    ///
    /// # Errors
    /// When the point is not finite or outside [`Self::world_limit_m`].
    #[inline]
    pub(crate) fn in_voxel(&self, point_in_world_m: [f64; 3]) -> Result<InVoxel, MapError> {
        let limit_m = self.world_limit_m();
        if !point_in_world_m.iter().all(|c| c.abs() <= limit_m) {
            return Err(MapError::OutOfWorld { point_in_world_m, limit_m });
        }
        let units = point_in_world_m.map(|c| (rounded(c * UNITS_PER_M) + self.origin_units() as i64) as u64);
        let voxel = units.map(|units| self.by_voxel.quotient(units));
        let edge = u64::from(self.voxel_units);
        Ok(InVoxel {
            // Voxels are at least 0.05 m and lie within 6e7 + 5e7 m, or there are at most 160 in each of 2²² tiles.
            voxel: voxel.map(|voxel| voxel as u32),
            offset_units: std::array::from_fn(|k| (units[k] - voxel[k] * edge) as u16),
        })
    }

    /// The tile of a voxel, and the voxel in it.
    #[inline]
    pub(crate) fn in_tile(&self, voxel: [u32; 3]) -> (TileId, Voxel) {
        let [x, y, z] = voxel;
        let [tile_x, tile_y] = [x, y].map(|n| self.by_tile.quotient(n.into()) as u32);
        let tile = TileId { x: tile_x as i32 - ORIGIN_TILES, y: tile_y as i32 - ORIGIN_TILES };
        let [x, y] = [(x, tile_x), (y, tile_y)].map(|(n, tile)| (n - tile * self.tile_voxels) as u16);
        let z = i64::from(z) - i64::from(ORIGIN_TILES) * i64::from(self.tile_voxels);
        (tile, Voxel { z: z as i32, y, x })
    }

    /// Distance in units from the origin of voxel indices to world zero: large enough that no index is negative.
    pub(crate) fn origin_units(&self) -> u64 {
        ORIGIN_TILES as u64 * u64::from(self.tile_voxels * self.voxel_units)
    }
}

/// Number of tiles between the origin of units and world zero: 6e7 m, as tiles with voxels of 0.05 m and more have at
/// least 30 m.
const ORIGIN_TILES: i32 = 1 << 21;

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn voxels_are_found_again_by_their_place_and_ordered_by_their_cells(
            a in (any::<i32>(), any::<u16>(), any::<u16>()), b in (any::<i32>(), any::<u16>(), any::<u16>()),
        ) {
            let voxel = |(z, y, x)| Voxel { z, y, x };
            let by_hand = |(z, y, x): (i32, u16, u16)| ((z >> 1, y >> 1, x >> 1), (z, y, x));
            prop_assert_eq!(Voxel::at(voxel(a).by_cell()), voxel(a));
            prop_assert_eq!(voxel(a).by_cell().cmp(&voxel(b).by_cell()), by_hand(a).cmp(&by_hand(b)));
            let cell = |voxel: Voxel| voxel.by_cell() >> VOXEL_OF_CELL_BITS;
            prop_assert_eq!(cell(voxel(a)) == cell(voxel(b)), by_hand(a).0 == by_hand(b).0);
        }
    }

    #[test]
    fn tiles_hold_whole_cells_near_32_m() {
        for (voxel_m, edge_m) in [
            (0.2, 31.99),
            (0.3, 31.8),
            (0.5, 32.0),
            (0.05, 32.0),
            (2.0, 32.0),
            (0.01, 1.6),
            (0.02, 3.2),
            (0.03, 4.8),
        ] {
            let lattice = Lattice::new(voxel_m).unwrap();
            assert_eq!(lattice.tile_voxels % 2, 0);
            assert!((lattice.tile_edge_m() - edge_m).abs() < 0.05, "{voxel_m}: {}", lattice.tile_edge_m());
            assert_eq!(Lattice::from_parts(lattice.voxel_units, lattice.tile_voxels), Some(lattice));
        }
        assert!(Lattice::new(0.009).is_err() && Lattice::new(f64::NAN).is_err());
        assert_eq!([0.2, 0.05].map(|v| Lattice::new(v).unwrap().world_limit_m()), [5e7; 2]);
        assert!((2.9e6..3.1e6).contains(&Lattice::new(0.01).unwrap().world_limit_m()));
    }

    proptest! {
        #[test]
        fn a_located_point_is_where_it_was(
            x in -1.0..1.0_f64, y in -1.0..1.0_f64, z in -1.0..1.0_f64, v in 0usize..6,
        ) {
            let lattice = Lattice::new([0.05, 0.2, 0.3, 2.0, 0.01, 0.02][v]).unwrap();
            let [x, y, z] = [x, y, z].map(|c| c * lattice.world_limit_m());
            let offset_units = lattice.in_voxel([x, y, z]).unwrap().offset_units;
            let (tile, place) = lattice.locate([x, y, z]).unwrap();
            let row = i64::from(lattice.tile_voxels);
            let voxel = [
                i64::from(tile.x) * row + i64::from(place.x),
                i64::from(tile.y) * row + i64::from(place.y),
                i64::from(place.z),
            ];
            prop_assert!(u32::from(place.x) < lattice.tile_voxels && u32::from(place.y) < lattice.tile_voxels);
            for (k, c) in [x, y, z].into_iter().enumerate() {
                prop_assert!(u32::from(offset_units[k]) < lattice.voxel_units);
                let units = voxel[k] * i64::from(lattice.voxel_units) + i64::from(offset_units[k]);
                prop_assert!((units as f64 - c * UNITS_PER_M).abs() <= 0.5);
            }
        }
    }

    proptest! {
        #[test]
        fn a_point_is_located_as_by_division(
            metres in prop::array::uniform3(-1.0..1.0_f64), near in prop::array::uniform3(-40.0..40.0_f64),
            halves in prop::array::uniform3(-1_000_000..1_000_000i64), v in 0.05..2.0_f64, room in any::<bool>(),
        ) {
            // Voxels of 0.01 to 0.06 m as often as others.
            let lattice = Lattice::new(if room { 0.01 + 0.025 * v } else { v }).unwrap();
            let limit_m = lattice.world_limit_m();
            let metres = metres.map(|c| c * limit_m);
            let edge = i64::from(lattice.voxel_units);
            let row = i64::from(lattice.tile_voxels);
            let halves = halves.map(|half| half as f64 / (2.0 * UNITS_PER_M));
            let corners = halves.map(|half| (half / lattice.tile_edge_m()).round() * lattice.tile_edge_m());
            for place in [metres, near, halves, corners, [limit_m; 3], [-limit_m; 3]] {
                let units = place.map(|c| (c * UNITS_PER_M).round() as i64);
                let voxel = units.map(|u| u.div_euclid(edge));
                let [x, y] = [voxel[0].div_euclid(row), voxel[1].div_euclid(row)];
                let tile = TileId { x: x as i32, y: y as i32 };
                let in_tile = Voxel {
                    x: (voxel[0] - x * row) as u16,
                    y: (voxel[1] - y * row) as u16,
                    z: voxel[2] as i32,
                };
                let offset_units = std::array::from_fn(|k| (units[k] - voxel[k] * edge) as u16);
                prop_assert_eq!(lattice.locate(place).unwrap(), (tile, in_tile));
                prop_assert_eq!(lattice.in_voxel(place).unwrap().offset_units, offset_units);
                prop_assert_eq!(lattice.tile_of(place).unwrap(), tile);
            }
        }
    }

    #[test]
    fn places_outside_the_world_are_refused() {
        let lattice = Lattice::new(0.2).unwrap();
        assert!(lattice.locate([f64::NAN, 0.0, 0.0]).is_err());
        assert!(lattice.locate([0.0, f64::INFINITY, 0.0]).is_err());
        assert!(lattice.locate([0.0, 0.0, -6e7]).is_err());
    }
}
