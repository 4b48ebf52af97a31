//! What threads find of frames in any order, kept on disk until it can be written in the order of the log.

use std::fs::File;
use std::io::{self, Read as _, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use anyhow::Context as _;

/// Pieces of frames in a file without a name: nothing is left of it, however the process ends. Memory is some bytes a
/// piece.
#[derive(Debug)]
pub(super) struct Spool {
    folder: PathBuf,
    kept: Mutex<Kept>,
}

#[derive(Debug)]
struct Kept {
    file: File,
    end: u64,
    pieces: Vec<Piece>,
}

#[derive(Debug, Clone, Copy)]
struct Piece {
    frame: u32,
    bytes: u32,
    at: u64,
}

impl Spool {
    /// An empty one in this folder.
    pub(super) fn new(folder: &Path) -> io::Result<Self> {
        let file = tempfile::tempfile_in(folder)?;
        let kept = Mutex::new(Kept { file, end: 0, pieces: Vec::new() });
        Ok(Self { folder: folder.to_owned(), kept })
    }

    /// Keeps a piece of a frame, behind the pieces of that frame that came before.
    pub(super) fn add(&self, frame: u32, piece: &[u8]) -> io::Result<()> {
        let bytes = u32::try_from(piece.len()).map_err(io::Error::other)?;
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        kept.file.write_all(piece)?;
        let at = kept.end;
        kept.end += piece.len() as u64;
        kept.pieces.push(Piece { frame, bytes, at });
        Ok(())
    }

    /// Everything that was kept, by frames.
    pub(super) fn sorted(self) -> Sorted {
        let Kept { file, mut pieces, .. } = self.kept.into_inner().unwrap_or_else(PoisonError::into_inner);
        // Stable: the pieces of a frame stay in their order.
        pieces.sort_by_key(|piece| piece.frame);
        Sorted { folder: self.folder, file, pieces }
    }
}

/// Pieces in order of their frames.
#[derive(Debug)]
pub(super) struct Sorted {
    folder: PathBuf,
    file: File,
    pieces: Vec<Piece>,
}

impl Sorted {
    /// Lengths of the pieces in order, bytes.
    pub(super) fn pieces(&self) -> impl Iterator<Item = usize> {
        self.pieces.iter().map(|piece| piece.bytes as usize)
    }

    /// Hands over the pieces in order, each with whether it is its frame's last. It can be asked again.
    pub(super) fn each(&self, mut take: impl FnMut(&[u8], bool) -> anyhow::Result<()>) -> anyhow::Result<()> {
        let mut piece = Vec::new();
        for (k, &Piece { frame, bytes, at }) in self.pieces.iter().enumerate() {
            piece.resize(bytes as usize, 0);
            let mut file = &self.file;
            let read = file.seek(SeekFrom::Start(at)).and_then(|_| file.read_exact(&mut piece));
            read.with_context(|| format!("{}: cannot read back what was kept there", self.folder.display()))?;
            let is_last = self.pieces.get(k + 1).is_none_or(|next| next.frame != frame);
            take(&piece, is_last)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_come_back_by_frames_whoever_kept_them_when() {
        let folder = tempfile::tempdir().unwrap();
        let spool = Spool::new(folder.path()).unwrap();
        // Each thread keeps every fourth frame, the last first, in pieces of different lengths.
        std::thread::scope(|threads| {
            for thread in 0..4_u32 {
                let spool = &spool;
                threads.spawn(move || {
                    for frame in (0..50).rev().filter(|frame| frame % 4 == thread) {
                        for piece in 0..3_u8 {
                            let bytes = vec![piece; (frame + u32::from(piece)) as usize];
                            spool.add(frame, &bytes).unwrap();
                        }
                    }
                });
            }
        });
        let sorted = spool.sorted();
        assert_eq!(sorted.pieces().sum::<usize>(), (0..50).map(|frame| 3 * frame + 3).sum::<usize>());
        let mut expected = (0..50_u32).flat_map(|frame| (0..3_u8).map(move |piece| (frame, piece)));
        let check = |bytes: &[u8], is_last: bool| {
            let (frame, piece) = expected.next().unwrap();
            assert_eq!(is_last, piece == 2);
            assert_eq!(bytes, vec![piece; (frame + u32::from(piece)) as usize]);
            Ok(())
        };
        sorted.each(check).unwrap();
        assert_eq!(expected.next(), None);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
