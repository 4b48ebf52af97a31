//! Opens a store: reads its header, directory and footer, and the bytes of its blobs.

use std::borrow::Cow;
use std::collections::HashMap;
use std::fs::File;
use std::hash::BuildHasherDefault;
use std::path::{Path, PathBuf};

use super::bytes::StoreBytes;
use super::layout::{
    Blob, Cursor, END_MAGIC, ENTRY_BYTES, FOOTER_BYTES, FORM, FRAME_BYTES, HEADER_BYTES, MAGIC,
    MAX_DIRECTORY_BYTES, Origin, TileEntry, VERSION,
};
use crate::MapError;
use crate::grid::{Lattice, MixHasher};
use dmp_disk::{TileId, open_input};
use dmp_sensor::{Isometry3, Point3};

/// A finished map of surfels, opened for reading; shared freely between threads.
///
/// Opening checks everything except the tiles; loading a tile checks that tile. Damaged data is never returned.
#[derive(Debug)]
pub struct Store {
    path: PathBuf,
    bytes: StoreBytes,
    lattice: Lattice,
    origin: Origin,
    entries: HashMap<TileId, TileEntry, BuildHasherDefault<MixHasher>>,
    bounds: Option<[TileId; 2]>,
}

impl Store {
    /// Opens a store and checks its header, directory and footer.
    ///
    /// # Errors
    /// When the file cannot be read, is no store, or is of another version, truncated or damaged.
    pub fn open(path: &Path) -> Result<Self, MapError> {
        let file = open_input(path).map_err(MapError::io(path, "cannot open the map"))?;
        Self::of(path, StoreBytes::read(file).map_err(MapError::io(path, "cannot read the map"))?)
    }

    /// Opens a store that this process wrote, and unlinks it: the file lives until the last reader closes it, however
    /// the process ends. (If the system does not allow that, the file keeps its name.)
    ///
    /// # Errors
    /// As [`Store::open`].
    pub fn open_once(path: &Path) -> Result<Self, MapError> {
        let file = File::open(path).map_err(MapError::io(path, "cannot open the map"))?;
        let bytes = match std::fs::remove_file(path) {
            Ok(()) => StoreBytes::mapped(&file),
            // A file that stays is removed with its work folder.
            Err(_) => StoreBytes::read(file),
        };
        Self::of(path, bytes.map_err(MapError::io(path, "cannot map the map"))?)
    }

    fn of(path: &Path, bytes: StoreBytes) -> Result<Self, MapError> {
        let not_a_store =
            |found: &[u8]| MapError::NotAStore { path: path.to_path_buf(), found: found.to_vec() };
        if bytes.len() < (HEADER_BYTES + FOOTER_BYTES) as u64 {
            return Err(not_a_store(&[]));
        }
        let read =
            |offset, length| bytes.at(offset, length).map_err(MapError::io(path, "cannot read the map"));
        let header = read(0, HEADER_BYTES as u64)?;
        if header[..8] != MAGIC {
            return Err(not_a_store(&header[..8]));
        }
        let damaged = |part, detail| MapError::Damaged { path: path.to_path_buf(), part, detail };
        let lattice = lattice_of(path, &header)?;
        let blobs_and_directory = bytes.len() - FOOTER_BYTES as u64;
        let footer = read(blobs_and_directory, FOOTER_BYTES as u64)?;
        let footer = Footer::of(&footer, blobs_and_directory).map_err(|detail| damaged("footer", detail))?;
        let directory = read(footer.directory_at, footer.directory_bytes)?;
        check_crc(&directory, footer.directory_crc32).map_err(|detail| damaged("directory", detail))?;
        let (origin, rows) =
            split_directory(&directory, footer.tiles).map_err(|d| damaged("directory", d))?;
        let mut entries: HashMap<_, _, _> = HashMap::default();
        let mut bounds: Option<[TileId; 2]> = None;
        for row in rows {
            let entry = TileEntry::decode(row);
            entry.check(footer.directory_at).map_err(|d| damaged("directory", d))?;
            let id = entry.tile;
            let [low, high] = bounds.get_or_insert([id, id]);
            *low = TileId { x: low.x.min(id.x), y: low.y.min(id.y) };
            *high = TileId { x: high.x.max(id.x), y: high.y.max(id.y) };
            if entries.insert(id, entry).is_some() {
                return Err(damaged("directory", format!("tile {id} is listed twice")));
            }
        }
        drop(directory);
        Ok(Self { path: path.to_path_buf(), bytes, lattice, origin, entries, bounds })
    }

    /// The path at which it was opened.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The grid of the map.
    pub fn lattice(&self) -> Lattice {
        self.lattice
    }

    /// The origin of the map.
    pub fn origin(&self) -> &Origin {
        &self.origin
    }

    /// The transform from the map's frame to its maker's.
    pub fn own_from_world(&self) -> &Isometry3<f64> {
        &self.origin.own_from_world
    }

    /// Smallest and largest x, y and z that the discs of a tile may reach in its maker's frame, metres.
    pub fn box_in_own_m(&self, entry: &TileEntry) -> [[f64; 3]; 2] {
        let ([x, y], edge_m) = (self.lattice.tile_corner_m(entry.tile), self.lattice.tile_edge_m());
        let [low_z, high_z] = entry.extent.z_range_m;
        let mut corners = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        for corner in 0..8 {
            let end = |axis: usize, low: f64, high: f64| if corner >> axis & 1 == 0 { low } else { high };
            let in_world = Point3::new(end(0, x, x + edge_m), end(1, y, y + edge_m), end(2, low_z, high_z));
            let in_own = self.own_from_world() * in_world;
            for axis in 0..3 {
                corners[0][axis] = corners[0][axis].min(in_own[axis]);
                corners[1][axis] = corners[1][axis].max(in_own[axis]);
            }
        }
        corners
    }

    /// The directory's entry of a tile; `None` where the map is empty.
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
        self.entries.values().map(|entry| u64::from(entry.own.surfels)).sum()
    }

    /// A blob's bytes, compared with its checksum.
    ///
    /// # Errors
    /// When they cannot be read, or are damaged.
    pub fn blob(&self, tile: TileId, blob: &Blob) -> Result<Cow<'_, [u8]>, MapError> {
        let damaged = |detail| self.damaged_tile(tile, blob, detail);
        let bytes = self.bytes.at(blob.offset, u64::from(blob.bytes));
        let bytes = bytes.map_err(|error| damaged(format!("cannot read it: {error}")))?;
        check_crc(&bytes, blob.crc32).map_err(damaged)?;
        Ok(bytes)
    }

    /// The error of a tile whose blob has invalid content.
    pub(super) fn damaged_tile(&self, tile: TileId, blob: &Blob, detail: String) -> MapError {
        MapError::DamagedTile { path: self.path.clone(), tile, offset: blob.offset, detail }
    }
}

fn lattice_of(path: &Path, header: &[u8]) -> Result<Lattice, MapError> {
    let damaged = |detail| MapError::Damaged { path: path.to_path_buf(), part: "header", detail };
    let mut at = Cursor { bytes: header, at: 8 };
    let (version, form) = (at.u32(), at.u32());
    let (voxel_units, tile_voxels, across_steps) = (at.u32(), at.u32(), at.u32());
    if version != VERSION {
        return Err(MapError::Version { path: path.to_path_buf(), found: version, known: VERSION });
    }
    let crc32 = Cursor { bytes: header, at: HEADER_BYTES - 4 }.u32();
    check_crc(&header[..HEADER_BYTES - 4], crc32).map_err(damaged)?;
    if form != FORM {
        return Err(damaged(format!("form {form} is unknown in version {VERSION}")));
    }
    let lattice = Lattice::from_parts(voxel_units, tile_voxels);
    lattice.filter(|lattice| lattice.across_steps() == across_steps).ok_or_else(|| {
        let grid = format!("voxels of {voxel_units} units of {across_steps} steps, {tile_voxels} a tile");
        damaged(format!("{grid}: invalid grid"))
    })
}

fn check_crc(bytes: &[u8], saved: u32) -> Result<(), String> {
    let calculated = crc32fast::hash(bytes);
    if calculated == saved {
        Ok(())
    } else {
        Err(format!("checksum {calculated:08x}, {saved:08x} was written"))
    }
}

struct Footer {
    directory_at: u64,
    directory_bytes: u64,
    directory_crc32: u32,
    tiles: u64,
}

impl Footer {
    /// Decodes its bytes, given their position in the file.
    fn of(footer: &[u8], footer_at: u64) -> Result<Self, String> {
        if footer[FOOTER_BYTES - 8..] != END_MAGIC {
            return Err(format!("no end mark at byte {footer_at}: the file was cut short"));
        }
        let mut at = Cursor { bytes: footer, at: 0 };
        let (directory_at, directory_bytes, directory_crc32, tiles) =
            (at.u64(), at.u64(), at.u32(), at.u64());
        check_crc(&footer[..FOOTER_BYTES - 12], at.u32())?;
        let end = directory_at.checked_add(directory_bytes).filter(|&end| end == footer_at);
        if end.is_none() || directory_at < HEADER_BYTES as u64 || directory_bytes > MAX_DIRECTORY_BYTES {
            return Err(format!(
                "a directory of {directory_bytes} bytes at byte {directory_at} does not fit the file"
            ));
        }
        Ok(Self { directory_at, directory_bytes, directory_crc32, tiles })
    }
}

fn split_directory(
    directory: &[u8],
    tiles: u64,
) -> Result<(Origin, impl Iterator<Item = &[u8; ENTRY_BYTES]> + use<'_>), String> {
    let text_bytes = Cursor { bytes: directory, at: 0 }.u32() as usize;
    let text = directory.get(4..4 + text_bytes).ok_or("its text does not fit")?;
    let text = std::str::from_utf8(text).map_err(|_| "its text is not UTF-8")?;
    let (frame, rows) =
        directory[4 + text_bytes..].split_first_chunk::<FRAME_BYTES>().ok_or("its frame does not fit")?;
    let own_from_world = Origin::frame_of(frame).ok_or("its frame is not a rigid motion")?;
    let (rows, rest) = rows.as_chunks::<ENTRY_BYTES>();
    if rows.len() as u64 != tiles || !rest.is_empty() {
        return Err(format!("it holds {} tiles, the footer says {tiles}", rows.len()));
    }
    Ok((Origin { text: text.to_owned(), own_from_world }, rows.iter()))
}
