use crate::lattice::TileId;
use crate::surfel::Surfel;
use crate::tiles::TileExtent;

/// Version of the store format this program writes and reads.
pub const VERSION: u32 = 1;

pub(super) const MAGIC: [u8; 8] = *b"DMPSTORE";
pub(super) const END_MAGIC: [u8; 8] = *b"DMPSTEND";
/// Magic, version, voxel units, tile voxels, CRC-32 of those; then the blobs.
pub(super) const HEADER_BYTES: usize = 24;
/// Offset, length and CRC-32 of the directory, number of tiles, CRC-32 of those, end magic.
pub(super) const FOOTER_BYTES: usize = 40;
pub(super) const ENTRY_BYTES: usize = 96;
pub(super) const SURFEL_BYTES: usize = 32;
/// Most surfels a tile may claim: bounds what a forged directory can make us allocate (1 GiB).
pub(super) const MAX_TILE_SURFELS: u32 = 1 << 25;
/// Longest provenance text kept in a store.
pub(super) const MAX_PROVENANCE_BYTES: usize = 1 << 20;

/// Where a compressed run of surfels lies in the file.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Blob {
    /// First byte.
    pub offset: u64,
    /// Compressed length, bytes.
    pub bytes: u32,
    /// Number of surfels in it.
    pub surfels: u32,
    /// CRC-32 of the compressed bytes.
    pub crc32: u32,
}

/// What the directory says of one tile.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TileEntry {
    /// Which tile.
    pub tile: TileId,
    /// Surfels whose voxels lie in the tile.
    pub own: Blob,
    /// Copies of neighbours' discs that reach into it.
    pub borders: Blob,
    /// Height that the tile's z counts from, world metres.
    pub base_z_m: f64,
    /// Bounds of its surfels, copies included.
    pub extent: TileExtent,
}

impl TileEntry {
    pub(super) fn new(tile: TileId, base_z_m: f64) -> Self {
        Self { tile, own: Blob::default(), borders: Blob::default(), base_z_m, extent: TileExtent::EMPTY }
    }

    /// Surfels to load: its own and the copies.
    pub fn surfels(&self) -> u64 {
        u64::from(self.own.surfels) + u64::from(self.borders.surfels)
    }

    pub(super) fn bound(&mut self, surfels: &[Surfel], radius_m: f32) {
        surfels.iter().for_each(|surfel| self.extent.add(surfel, self.base_z_m, radius_m));
    }

    pub(super) fn encode(&self, out: &mut Vec<u8>) {
        out.extend(self.tile.y.to_le_bytes());
        out.extend(self.tile.x.to_le_bytes());
        for blob in [self.own, self.borders] {
            out.extend(blob.offset.to_le_bytes());
            out.extend(blob.bytes.to_le_bytes());
            out.extend(blob.surfels.to_le_bytes());
            out.extend(blob.crc32.to_le_bytes());
            out.extend([0; 4]);
        }
        let TileExtent { z_range_m, min_third_lowest, max_third_highest } = self.extent;
        for value in [self.base_z_m, z_range_m[0], z_range_m[1]] {
            out.extend(value.to_le_bytes());
        }
        out.extend(min_third_lowest.to_le_bytes());
        out.extend(max_third_highest.to_le_bytes());
        out.extend([0; 8]);
    }

    pub(super) fn decode(bytes: &[u8; ENTRY_BYTES]) -> Self {
        let mut at = Cursor { bytes, at: 0 };
        let tile = TileId { y: at.i32(), x: at.i32() };
        let mut blob = || {
            let blob = Blob { offset: at.u64(), bytes: at.u32(), surfels: at.u32(), crc32: at.u32() };
            at.u32();
            blob
        };
        let (own, borders) = (blob(), blob());
        let (base_z_m, z_range_m) = (at.f64(), [at.f64(), at.f64()]);
        let (min_third_lowest, max_third_highest) = (at.i32(), at.i32());
        let extent = TileExtent { z_range_m, min_third_lowest, max_third_highest };
        Self { tile, own, borders, base_z_m, extent }
    }
}

/// Little-endian numbers from bytes whose length the caller has checked; past the end they are zero.
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

/// Surfels as columns of 32-bit little-endian words: three of centre, three of normal, two of support.
pub(super) fn encode_columns(surfels: &[Surfel], out: &mut Vec<u8>) {
    out.clear();
    out.reserve(surfels.len() * SURFEL_BYTES);
    for k in 0..3 {
        surfels.iter().for_each(|s| out.extend(s.centre_in_tile_m[k].to_le_bytes()));
    }
    for k in 0..3 {
        surfels.iter().for_each(|s| out.extend(s.normal[k].to_le_bytes()));
    }
    surfels.iter().for_each(|s| out.extend(s.third_lowest.to_le_bytes()));
    surfels.iter().for_each(|s| out.extend(s.third_highest.to_le_bytes()));
}

/// The inverse of [`encode_columns`], appended to `out`; `bytes` holds whole surfels.
pub(super) fn decode_columns(bytes: &[u8], out: &mut Vec<Surfel>) {
    let count = bytes.len() / SURFEL_BYTES;
    let word = |column: usize, row: usize| {
        let at = (column * count + row) * 4;
        bytes.get(at..at + 4).and_then(|b| b.try_into().ok()).map_or(0, u32::from_le_bytes)
    };
    out.extend((0..count).map(|row| Surfel {
        centre_in_tile_m: std::array::from_fn(|k| f32::from_bits(word(k, row))),
        normal: std::array::from_fn(|k| f32::from_bits(word(3 + k, row))),
        third_lowest: word(6, row) as i32,
        third_highest: word(7, row) as i32,
    }));
}
