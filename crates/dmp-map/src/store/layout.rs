//! The byte layout of a store, except the blobs.

use dmp_disk::TileId;

use super::columns::{CELL_BYTES, SURFEL_BYTES};
use crate::grid::{Lattice, UNITS_PER_M};
use crate::surfels::{Surfel, TileExtent};
use dmp_sensor::{Isometry3, Quaternion, Translation3, UnitQuaternion};

/// Version of the store format this program writes and reads.
pub const VERSION: u32 = 4;

/// The header's code for the form of blobs: compressed codes of surfels.
pub(super) const FORM: u32 = 1;
pub(super) const MAGIC: [u8; 8] = *b"DMPSTORE";
pub(super) const END_MAGIC: [u8; 8] = *b"DMPSTEND";
/// Magic, version, [`FORM`], voxel units, tile voxels, steps across, zeros, CRC-32 of those; then the blobs.
pub(super) const HEADER_BYTES: usize = 64;
/// Offset, length and CRC-32 of the directory, number of tiles, CRC-32 of those, end magic.
pub(super) const FOOTER_BYTES: usize = 40;
pub(super) const ENTRY_BYTES: usize = 108;
/// The frame of the map: x, y, z and the quaternion x, y, z, w.
pub(super) const FRAME_BYTES: usize = 56;
/// Most surfels of a tile: limits the allocation for a forged directory (1 GiB).
pub(super) const MAX_TILE_SURFELS: u32 = 1 << 25;
/// Longest text kept in a store.
pub(super) const MAX_TEXT_BYTES: usize = 1 << 20;
/// Limit of a directory, which is read whole: five million tiles less a few.
pub(super) const MAX_DIRECTORY_BYTES: u64 = 512 << 20;
/// Upper limit of zstd's ratio: a block of at least 4 bytes gives at most 128 KiB.
const MOST_INFLATION: u64 = 1 << 15;

/// A range of bytes in the file, and its content.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Blob {
    /// First byte.
    pub offset: u64,
    /// Length, bytes.
    pub bytes: u32,
    /// Number of surfels.
    pub surfels: u32,
    /// Number of cells that hold them.
    pub rows: u32,
    /// CRC-32 of the bytes.
    pub crc32: u32,
}

/// The origin of a map: the description in its file.
#[derive(Debug, Clone, PartialEq)]
pub struct Origin {
    /// A text for display, up to a mebibyte.
    pub text: String,
    /// The frame of the map relative to its maker's. A run's map is computed in the canonical frame and reported in the
    /// frame of its trajectory.
    pub own_from_world: Isometry3<f64>,
}

impl Origin {
    /// The origin of a map in its maker's own frame.
    pub fn of(text: impl Into<String>) -> Self {
        Self { text: text.into(), own_from_world: Isometry3::identity() }
    }

    pub(super) fn frame_bytes(&self) -> Vec<u8> {
        let (place, rotation) = (self.own_from_world.translation.vector, self.own_from_world.rotation.coords);
        place.iter().chain(rotation.iter()).flat_map(|number| number.to_le_bytes()).collect()
    }

    /// The frame in these bytes, if valid.
    pub(super) fn frame_of(bytes: &[u8; FRAME_BYTES]) -> Option<Isometry3<f64>> {
        let mut at = Cursor { bytes, at: 0 };
        let [x, y, z, i, j, k, w]: [f64; 7] = std::array::from_fn(|_| at.f64());
        let rotation = Quaternion::new(w, i, j, k);
        let is_frame = [x, y, z].iter().all(|c| c.is_finite()) && (rotation.norm() - 1.0).abs() < 1e-9;
        // Bit-identical to what was written.
        is_frame.then(|| {
            Isometry3::from_parts(Translation3::new(x, y, z), UnitQuaternion::new_unchecked(rotation))
        })
    }
}

/// The directory's entry of a tile.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TileEntry {
    /// The tile.
    pub tile: TileId,
    /// Surfels whose voxels lie in the tile.
    pub own: Blob,
    /// Copies of neighbours' discs that reach into it.
    pub borders: Blob,
    /// Surfels whose voxels lie in the tile and that the map leaves out.
    pub left_out: Blob,
    /// z of the voxels on whose lower faces the tile's z is 0.
    pub base_voxel_z: i32,
    /// Bounds of its surfels, copies included.
    pub extent: TileExtent,
}

impl TileEntry {
    pub(super) fn new(tile: TileId, base_voxel_z: i32) -> Self {
        let [own, borders, left_out] = [Blob::default(); 3];
        Self { tile, own, borders, left_out, base_voxel_z, extent: TileExtent::EMPTY }
    }

    /// All its blobs.
    pub fn blobs(&self) -> [Blob; 3] {
        [self.own, self.borders, self.left_out]
    }

    /// Surfels to load: its own and the copies.
    pub fn surfels(&self) -> u64 {
        u64::from(self.own.surfels) + u64::from(self.borders.surfels)
    }

    /// The origin of the tile's coordinates: its corner, and a z among its surfels, world metres.
    pub fn origin_in_world_m(&self, lattice: &Lattice) -> [f64; 3] {
        let [x, y] = lattice.tile_corner_m(self.tile);
        let base_units = i64::from(self.base_voxel_z) * i64::from(lattice.voxel_units());
        [x, y, base_units as f64 / UNITS_PER_M]
    }

    pub(super) fn bound(&mut self, surfels: impl Iterator<Item = Surfel>, lattice: &Lattice) {
        let base_z_m = self.origin_in_world_m(lattice)[2];
        let radius_m = lattice.disc_radius_m() as f32;
        surfels.for_each(|surfel| self.extent.add(&surfel, base_z_m, radius_m));
    }

    pub(super) fn encode(&self, out: &mut Vec<u8>) {
        let TileExtent { z_range_m, min_third_lowest, max_third_highest } = self.extent;
        for value in [self.tile.y, self.tile.x, self.base_voxel_z, min_third_lowest, max_third_highest] {
            out.extend(value.to_le_bytes());
        }
        for value in z_range_m {
            out.extend(value.to_le_bytes());
        }
        for blob in self.blobs() {
            out.extend(blob.offset.to_le_bytes());
            for value in [blob.bytes, blob.surfels, blob.rows, blob.crc32] {
                out.extend(value.to_le_bytes());
            }
        }
    }

    pub(super) fn decode(bytes: &[u8; ENTRY_BYTES]) -> Self {
        let mut at = Cursor { bytes, at: 0 };
        let tile = TileId { y: at.i32(), x: at.i32() };
        let (base_voxel_z, min_third_lowest, max_third_highest) = (at.i32(), at.i32(), at.i32());
        let z_range_m = [at.f64(), at.f64()];
        let mut blob =
            || Blob { offset: at.u64(), bytes: at.u32(), surfels: at.u32(), rows: at.u32(), crc32: at.u32() };
        let (own, borders, left_out) = (blob(), blob(), blob());
        let extent = TileExtent { z_range_m, min_third_lowest, max_third_highest };
        Self { tile, own, borders, left_out, base_voxel_z, extent }
    }

    /// Whether it is valid in a file whose blobs end at `blobs_end`.
    pub(super) fn check(&self, blobs_end: u64) -> Result<(), String> {
        for blob in self.blobs() {
            let end = blob.offset.checked_add(u64::from(blob.bytes));
            let inside = blob.offset >= HEADER_BYTES as u64 && end.is_some_and(|end| end <= blobs_end);
            let empty = blob.bytes == 0 && blob.rows == 0 && blob.surfels == 0;
            if !(empty || inside && blob.codes_fit()) || blob.surfels > MAX_TILE_SURFELS {
                return Err(format!(
                    "tile {}: {} surfels, {} rows, in {} bytes at byte {} do not fit the file",
                    self.tile, blob.surfels, blob.rows, blob.bytes, blob.offset
                ));
            }
        }
        let [low, high] = self.extent.z_range_m;
        if !(low.is_finite() && high.is_finite() && low <= high) {
            return Err(format!("tile {}: heights {low} to {high} m", self.tile));
        }
        Ok(())
    }
}

impl Blob {
    /// Uncompressed bytes of the blob.
    pub(super) fn unzipped_bytes(&self) -> u64 {
        u64::from(self.rows) * CELL_BYTES as u64 + u64::from(self.surfels) * SURFEL_BYTES as u64
    }

    /// Whether this many cells can have this many surfels, and this many bytes can decompress to both.
    fn codes_fit(&self) -> bool {
        let (cells, surfels) = (u64::from(self.rows), u64::from(self.surfels));
        (cells..=8 * cells).contains(&surfels)
            && self.unzipped_bytes() <= u64::from(self.bytes) * MOST_INFLATION
    }
}

/// Reads little-endian numbers from bytes whose length the caller has checked; past the end they are zero.
pub(super) struct Cursor<'a> {
    pub(super) bytes: &'a [u8],
    pub(super) at: usize,
}

impl Cursor<'_> {
    fn take<const N: usize>(&mut self) -> [u8; N] {
        let mut out = [0; N];
        if let Some(bytes) = self.bytes.get(self.at..self.at + N) {
            out.copy_from_slice(bytes);
        }
        self.at += N;
        out
    }

    pub(super) fn u32(&mut self) -> u32 {
        u32::from_le_bytes(self.take())
    }

    pub(super) fn i32(&mut self) -> i32 {
        i32::from_le_bytes(self.take())
    }

    pub(super) fn u64(&mut self) -> u64 {
        u64::from_le_bytes(self.take())
    }

    pub(super) fn f64(&mut self) -> f64 {
        f64::from_le_bytes(self.take())
    }
}
