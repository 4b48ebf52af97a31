//! Errors of maps.

use std::path::{Path, PathBuf};

use dmp_disk::{DiskError, TileId};

/// An error of a map. Every variant names the file, the position or the value.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MapError {
    /// A voxel edge for which the sums would not be exact.
    #[error("a voxel edge of {voxel_m} m is outside 0.01 to 2 m")]
    VoxelOutOfRange {
        /// The given edge, metres.
        voxel_m: f64,
    },
    /// A point that is not finite or too far from the origin.
    #[error("the point {point_in_world_m:?} m is outside the world of ±{limit_m:e} m")]
    OutOfWorld {
        /// The point, metres.
        point_in_world_m: [f64; 3],
        /// The largest coordinate allowed, metres.
        limit_m: f64,
    },
    /// A length that is not a positive number of metres.
    #[error("{metres} m is not a valid {what}")]
    NoLength {
        /// Its meaning.
        what: &'static str,
        /// The value, metres.
        metres: f64,
    },
    /// A normal that is not a unit vector.
    #[error("the normal {normal:?} is not a unit vector")]
    NoNormal {
        /// The vector.
        normal: [f32; 3],
    },
    /// From a file, or the scratch file.
    #[error(transparent)]
    Disk(#[from] DiskError),
    /// The file is not a map store.
    #[error("{}: not a map store (it starts with {found:02x?})", path.display())]
    NotAStore {
        /// The file.
        path: PathBuf,
        /// Its first bytes.
        found: Vec<u8>,
    },
    /// The store was written by another version.
    #[error("{}: store version {found}, this program reads version {known}", path.display())]
    Version {
        /// The file.
        path: PathBuf,
        /// Version in the file.
        found: u32,
        /// Version of this program.
        known: u32,
    },
    /// The store is damaged outside its tiles: truncated, or with a wrong checksum.
    #[error("{}: damaged in its {part}: {detail}", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// Which part.
        part: &'static str,
        /// The damage, with the values.
        detail: String,
    },
    /// One tile is damaged.
    #[error("{}: tile {tile} at byte {offset} is damaged: {detail}", path.display())]
    DamagedTile {
        /// The file.
        path: PathBuf,
        /// The tile.
        tile: TileId,
        /// Its first byte.
        offset: u64,
        /// The damage, with the values.
        detail: String,
    },
    /// A triangle with an edge longer than any real surface has.
    #[error(
        "triangle {triangle} (from 0) has an edge of {edge_m:.3e} m: is a vertex wrong, or the mesh in another unit?"
    )]
    TriangleTooLong {
        /// Its number, from 0.
        triangle: u64,
        /// Its longest edge, metres.
        edge_m: f64,
    },
    /// A mesh with more area than can be sampled.
    #[error(
        "triangle {triangle} (from 0) brings the mesh to {area_m2:.3e} m², too large for a sample every {spacing_m} m: choose a larger spacing, or check the unit"
    )]
    TooManySamples {
        /// The triangle's number, from 0.
        triangle: u64,
        /// Area up to it, square metres.
        area_m2: f64,
        /// The spacing, metres.
        spacing_m: f64,
    },
}

impl MapError {
    pub(crate) fn io(path: &Path, what: &'static str) -> impl FnOnce(std::io::Error) -> Self {
        let io = DiskError::io(path, what);
        move |source| Self::Disk(io(source))
    }
}
