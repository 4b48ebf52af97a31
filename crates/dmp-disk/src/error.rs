//! What can go wrong on disk.

use std::path::{Path, PathBuf};

use crate::TileId;

/// What can go wrong on disk. Every variant names the file, the folder or the tile.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DiskError {
    /// A file could not be read or written.
    #[error("{}: {what}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What was being done.
        what: &'static str,
        /// The system's reason.
        source: std::io::Error,
    },
    /// What was kept for another process is damaged: cut short, or a checksum that does not match.
    #[error("{}: damaged in its {part}: {detail}", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// Which part.
        part: &'static str,
        /// What is wrong with it, with the values.
        detail: String,
    },
    /// Another process works in the folder.
    #[error("{}: another process is at work here", path.display())]
    Locked {
        /// The work folder.
        path: PathBuf,
    },
    /// Spilled records could not be read back as they were written.
    #[error("the scratch file changed on disk (tile {tile})")]
    ScratchDamaged {
        /// The tile.
        tile: TileId,
    },
}

impl DiskError {
    /// Makes an [`Io`](Self::Io) of the system's error: `what` was being done with the file at `path`.
    pub fn io(path: &Path, what: &'static str) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.to_path_buf();
        move |source| Self::Io { path, what, source }
    }
}
