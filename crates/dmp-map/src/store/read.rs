use std::collections::HashMap;
use std::fs::File;
use std::hash::BuildHasherDefault;
use std::path::{Path, PathBuf};

use memmap2::Mmap;

use super::layout::{
    Blob, Cursor, END_MAGIC, ENTRY_BYTES, FOOTER_BYTES, HEADER_BYTES, MAGIC, MAX_TILE_SURFELS, SURFEL_BYTES,
    TileEntry, VERSION, decode_columns,
};
use crate::MapError;
use crate::lattice::{Lattice, TileId};
use crate::surfel::Surfel;
use crate::tile_moments::MixHasher;

/// A finished store, opened for reading; shared freely between threads.
///
/// Opening checks everything but the tiles, loading a tile checks that tile: nothing damaged is ever
/// handed out.
#[derive(Debug)]
pub struct Store {
    path: PathBuf,
    bytes: Mmap,
    lattice: Lattice,
    provenance: String,
    entries: HashMap<TileId, TileEntry, BuildHasherDefault<MixHasher>>,
    bounds: Option<[TileId; 2]>,
}

/// One tile in memory: its own surfels, then the copies of its neighbours' border discs.
#[derive(Debug, Clone, PartialEq)]
pub struct Tile {
    /// Which tile.
    pub id: TileId,
    /// The place that the surfels' coordinates count from: the tile's corner and a z amid its surfels, world metres.
    pub origin_in_world_m: [f64; 3],
    /// The surfels.
    pub surfels: Vec<Surfel>,
    /// How many of them, in front, are the tile's own.
    pub own: usize,
}

impl Tile {
    /// Height that the tile's z counts from, world metres.
    pub fn base_z_m(&self) -> f64 {
        self.origin_in_world_m[2]
    }
}

impl Store {
    /// Opens a store and checks its header, directory and footer.
    ///
    /// # Errors
    /// When the file cannot be read, is no store, is of another version, cut short or damaged.
    pub fn open(path: &Path) -> Result<Self, MapError> {
        let file = File::open(path).map_err(MapError::io(path, "cannot open the map"))?;
        let length = file.metadata().map_err(MapError::io(path, "cannot read the map"))?.len();
        let not_a_store =
            |found: &[u8]| MapError::NotAStore { path: path.to_path_buf(), found: found.to_vec() };
        if length < (HEADER_BYTES + FOOTER_BYTES) as u64 {
            return Err(not_a_store(&[]));
        }
        // SAFETY: stores are written under a temporary name, renamed when whole and never changed after;
        // a file that others truncate while it is mapped is outside what this program can guard.
        #[expect(unsafe_code, reason = "mapping a file is unsafe in Rust; the store's files never change")]
        let bytes = unsafe { Mmap::map(&file) }.map_err(MapError::io(path, "cannot map the map"))?;
        if bytes[..8] != MAGIC {
            return Err(not_a_store(&bytes[..8]));
        }
        let damaged = |part, detail| MapError::Damaged { path: path.to_path_buf(), part, detail };
        let header = &bytes[..HEADER_BYTES];
        let mut at = Cursor { bytes: header, at: 8 };
        let (version, voxel_units, tile_voxels, crc32) = (at.u32(), at.u32(), at.u32(), at.u32());
        if version != VERSION {
            return Err(MapError::Version { path: path.to_path_buf(), found: version, known: VERSION });
        }
        check_crc(&header[..HEADER_BYTES - 4], crc32).map_err(|d| damaged("header", d))?;
        let lattice = Lattice::from_parts(voxel_units, tile_voxels).ok_or_else(|| {
            damaged("header", format!("voxels of {voxel_units} units, {tile_voxels} a tile: no such grid"))
        })?;

        let directory = directory_of(&bytes).map_err(|(part, detail)| damaged(part, detail))?;
        let blobs_end = bytes.len() as u64 - FOOTER_BYTES as u64 - directory.bytes.len() as u64;
        let (provenance, rows) = split_directory(&directory).map_err(|d| damaged("directory", d))?;
        let mut entries: HashMap<_, _, _> = HashMap::default();
        let mut bounds: Option<[TileId; 2]> = None;
        for row in rows {
            let entry = TileEntry::decode(row);
            check_entry(&entry, blobs_end).map_err(|d| damaged("directory", d))?;
            let id = entry.tile;
            let [low, high] = bounds.get_or_insert([id, id]);
            *low = TileId { x: low.x.min(id.x), y: low.y.min(id.y) };
            *high = TileId { x: high.x.max(id.x), y: high.y.max(id.y) };
            if entries.insert(id, entry).is_some() {
                return Err(damaged("directory", format!("tile {id} is listed twice")));
            }
        }
        let provenance = provenance.to_owned();
        Ok(Self { path: path.to_path_buf(), bytes, lattice, provenance, entries, bounds })
    }

    /// Opens a store and takes its name away: the file lives as long as somebody reads it and vanishes
    /// then, however the process ends. (Where the system does not allow that, it keeps its name.)
    ///
    /// # Errors
    /// As [`Store::open`].
    pub fn open_once(path: &Path) -> Result<Self, MapError> {
        let store = Self::open(path)?;
        // A name that stays is removed with the work folder it is in.
        let _ = std::fs::remove_file(path);
        Ok(store)
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The grid of the map.
    pub fn lattice(&self) -> Lattice {
        self.lattice
    }

    /// The text its maker left in it.
    pub fn provenance(&self) -> &str {
        &self.provenance
    }

    /// What the directory says of a tile; `None` where the map is empty.
    #[inline]
    pub fn entry(&self, tile: TileId) -> Option<&TileEntry> {
        self.entries.get(&tile)
    }

    /// All tiles, in no particular order.
    pub fn entries(&self) -> impl Iterator<Item = &TileEntry> {
        self.entries.values()
    }

    /// The smallest and largest column and row of any tile; `None` for an empty map.
    pub fn bounds(&self) -> Option<[TileId; 2]> {
        self.bounds
    }

    /// Surfels of the map, copies over borders not counted.
    pub fn surfels(&self) -> u64 {
        self.entries.values().map(|e| u64::from(e.own.surfels)).sum()
    }

    /// Loads a tile; `None` where the map is empty. `O(surfels)`.
    ///
    /// # Errors
    /// When the tile's bytes are not those that were written.
    pub fn load(&self, tile: TileId) -> Result<Option<Tile>, MapError> {
        let Some(entry) = self.entries.get(&tile) else { return Ok(None) };
        let mut surfels = Vec::with_capacity(entry.surfels() as usize);
        for blob in [&entry.own, &entry.borders] {
            self.load_blob(blob, &mut surfels).map_err(|detail| MapError::DamagedTile {
                path: self.path.clone(),
                tile,
                offset: blob.offset,
                detail,
            })?;
        }
        let [x, y] = self.lattice.tile_corner_m(tile);
        let own = entry.own.surfels as usize;
        Ok(Some(Tile { id: tile, origin_in_world_m: [x, y, entry.base_z_m], surfels, own }))
    }

    fn load_blob(&self, blob: &Blob, out: &mut Vec<Surfel>) -> Result<(), String> {
        if blob.surfels == 0 {
            return Ok(());
        }
        let start = blob.offset as usize;
        let compressed =
            self.bytes.get(start..start + blob.bytes as usize).ok_or("it ends outside the file")?;
        check_crc(compressed, blob.crc32)?;
        let wanted = blob.surfels as usize * SURFEL_BYTES;
        let columns =
            zstd::bulk::decompress(compressed, wanted).map_err(|e| format!("cannot decompress: {e}"))?;
        if columns.len() != wanted {
            return Err(format!("it holds {} bytes, not {wanted}", columns.len()));
        }
        decode_columns(&columns, out);
        Ok(())
    }
}

fn check_crc(bytes: &[u8], saved: u32) -> Result<(), String> {
    let calculated = crc32fast::hash(bytes);
    if calculated == saved {
        Ok(())
    } else {
        Err(format!("checksum {calculated:08x}, {saved:08x} was written"))
    }
}

struct Directory<'a> {
    bytes: &'a [u8],
    tiles: u64,
}

fn directory_of(bytes: &[u8]) -> Result<Directory<'_>, (&'static str, String)> {
    let footer_at = bytes.len() - FOOTER_BYTES;
    let footer = &bytes[footer_at..];
    if footer[FOOTER_BYTES - 8..] != END_MAGIC {
        return Err(("footer", format!("no end mark at byte {footer_at}: the file was cut short")));
    }
    let mut at = Cursor { bytes: footer, at: 0 };
    let (offset, length, crc32, tiles, footer_crc32) = (at.u64(), at.u64(), at.u32(), at.u64(), at.u32());
    check_crc(&footer[..FOOTER_BYTES - 12], footer_crc32).map_err(|d| ("footer", d))?;
    let end = offset.checked_add(length).filter(|&end| end == footer_at as u64);
    if end.is_none() || offset < HEADER_BYTES as u64 {
        return Err((
            "footer",
            format!("a directory of {length} bytes at byte {offset} does not fit the file"),
        ));
    }
    let directory = &bytes[offset as usize..footer_at];
    check_crc(directory, crc32).map_err(|d| ("directory", d))?;
    Ok(Directory { bytes: directory, tiles })
}

fn split_directory<'a>(
    directory: &Directory<'a>,
) -> Result<(&'a str, impl Iterator<Item = &'a [u8; ENTRY_BYTES]> + use<'a>), String> {
    let text_bytes = Cursor { bytes: directory.bytes, at: 0 }.u32() as usize;
    let text = directory.bytes.get(4..4 + text_bytes).ok_or("its text does not fit")?;
    let text = std::str::from_utf8(text).map_err(|_| "its text is not UTF-8")?;
    let (rows, rest) = directory.bytes[4 + text_bytes..].as_chunks::<ENTRY_BYTES>();
    if rows.len() as u64 != directory.tiles || !rest.is_empty() {
        return Err(format!("it holds {} tiles, the footer says {}", rows.len(), directory.tiles));
    }
    Ok((text, rows.iter()))
}

fn check_entry(entry: &TileEntry, blobs_end: u64) -> Result<(), String> {
    for blob in [&entry.own, &entry.borders] {
        let end = blob.offset.checked_add(u64::from(blob.bytes));
        let empty = blob.surfels == 0 && blob.bytes == 0;
        let inside = blob.offset >= HEADER_BYTES as u64 && end.is_some_and(|end| end <= blobs_end);
        if !(empty || inside) || blob.surfels > MAX_TILE_SURFELS {
            return Err(format!(
                "tile {}: {} surfels in {} bytes at byte {} do not fit the file",
                entry.tile, blob.surfels, blob.bytes, blob.offset
            ));
        }
    }
    let [low, high] = entry.extent.z_range_m;
    if !(entry.base_z_m.is_finite() && low.is_finite() && high.is_finite() && low <= high) {
        return Err(format!("tile {}: heights {low} to {high} m over {} m", entry.tile, entry.base_z_m));
    }
    Ok(())
}
