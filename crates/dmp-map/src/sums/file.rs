//! A file of voxel sums, sorted by tiles.

use std::io::{BufWriter, Read as _, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};

use dmp_disk::{OutputFile, TileId, open_input};
use serde::{Deserialize, Serialize};

use super::packed::{BLOCK, RECORD_BYTES, pack, unpack};
use crate::MapError;
use crate::fuser::MapFuser;
use crate::voxels::VoxelRecord;
use crate::write_map::SummedTiles as _;

/// Some voxels of a tile in a file: row and column of the tile, offset, length in bytes, number of voxels, and CRC-32
/// of the bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct SumsBlock {
    y: i32,
    x: i32,
    offset: u64,
    bytes: u32,
    voxels: u32,
    crc32: u32,
}

impl SumsBlock {
    /// The tile.
    pub fn tile(&self) -> TileId {
        TileId { y: self.y, x: self.x }
    }

    /// Its byte range in the file.
    pub fn range(&self) -> std::ops::Range<u64> {
        self.offset..self.offset.saturating_add(u64::from(self.bytes))
    }

    /// Number of voxels.
    pub fn voxels(&self) -> u64 {
        u64::from(self.voxels)
    }
}

/// The content of a file of sums: tile after tile, with the voxels by their cells.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SumsList {
    /// Its blocks, those of a tile consecutive.
    pub blocks: Vec<SumsBlock>,
    /// Points that were added.
    pub points: u64,
}

impl MapFuser {
    /// Writes all sums to a new file at `path`, which appears when it is complete; the list of its blocks is returned.
    ///
    /// # Errors
    /// When the scratch file cannot be read back or the file cannot be written.
    pub fn write_sums(self, path: &Path) -> Result<SumsList, MapError> {
        let io = |what| MapError::io(path, what);
        let output = OutputFile::create(path).map_err(io("cannot create the file"))?;
        let mut file = BufWriter::new(output.file().map_err(io("cannot create the file"))?);
        let mut list = SumsList { points: self.points(), ..SumsList::default() };
        let (mut offset, mut records, mut planes) = (0, Vec::with_capacity(BLOCK), Vec::new());
        for tile in self.tiles() {
            let mut voxels = self.voxels_of(tile).peekable();
            while voxels.peek().is_some() {
                records.clear();
                for record in voxels.by_ref().take(BLOCK) {
                    records.push(record?);
                }
                let packed = pack(&records, &mut planes).map_err(io("cannot compress voxels"))?;
                file.write_all(&packed).map_err(io("cannot write the file"))?;
                list.blocks.push(SumsBlock {
                    y: tile.y,
                    x: tile.x,
                    offset,
                    bytes: packed.len() as u32,
                    voxels: records.len() as u32,
                    crc32: crc32fast::hash(&packed),
                });
                offset += packed.len() as u64;
            }
        }
        file.into_inner().map_err(|e| io("cannot write the file")(e.into_error()))?;
        output.commit().map_err(io("cannot give the file its name"))?;
        Ok(list)
    }
}

/// A file of sums, to merge with others.
#[derive(Debug)]
pub struct SumsFile {
    path: PathBuf,
    /// In the order of their tiles.
    blocks: Vec<SumsBlock>,
}

impl SumsFile {
    /// The file at `path`, described by `list`. It is open only while it is read: there may be thousands.
    ///
    /// # Errors
    /// When the list is not valid for a file.
    pub fn listed(path: &Path, list: SumsList) -> Result<Self, MapError> {
        let is_sorted = list.blocks.is_sorted_by_key(SumsBlock::tile);
        let fits = |block: &SumsBlock| (1..=BLOCK as u32).contains(&block.voxels);
        // More than records that do not compress at all.
        let most = 2 * (BLOCK * RECORD_BYTES) as u32;
        if !is_sorted || !list.blocks.iter().all(|block| fits(block) && block.bytes <= most) {
            let detail = "its blocks are inconsistent".to_owned();
            return Err(MapError::Damaged { path: path.to_owned(), part: "list of voxel sums", detail });
        }
        Ok(Self { path: path.to_owned(), blocks: list.blocks })
    }

    /// Its blocks, in the order of their tiles.
    pub(super) fn blocks(&self) -> &[SumsBlock] {
        &self.blocks
    }

    /// The voxels of a tile, by their cells; one block of them is in memory.
    pub(super) fn voxels_of(&self, tile: TileId) -> impl Iterator<Item = Result<VoxelRecord, MapError>> {
        let from = self.blocks.partition_point(|block| block.tile() < tile);
        let of_tile = self.blocks.iter().skip(from).take_while(move |block| block.tile() == tile);
        of_tile.flat_map(|block| {
            let (records, error) = match self.read(block) {
                Ok(records) => (records, None),
                Err(error) => (Vec::new(), Some(Err(error))),
            };
            records.into_iter().map(Ok).chain(error)
        })
    }

    fn read(&self, block: &SumsBlock) -> Result<Vec<VoxelRecord>, MapError> {
        let damaged = |detail| MapError::Damaged {
            path: self.path.clone(),
            part: "voxel sums",
            detail: format!("tile {}, byte {}: {detail}", block.tile(), block.offset),
        };
        let mut file = open_input(&self.path).map_err(MapError::io(&self.path, "cannot open the file"))?;
        let mut packed = vec![0; block.bytes as usize];
        let read = file.seek(SeekFrom::Start(block.offset)).and_then(|_| file.read_exact(&mut packed));
        read.map_err(|error| damaged(format!("cannot read {} bytes: {error}", block.bytes)))?;
        let crc32 = crc32fast::hash(&packed);
        if crc32 != block.crc32 {
            return Err(damaged(format!("checksum {crc32:08x}, {:08x} was written", block.crc32)));
        }
        unpack(&packed, block.voxels as usize).map_err(damaged)
    }
}
