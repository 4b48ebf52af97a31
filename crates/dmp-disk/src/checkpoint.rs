//! What a work folder keeps for another process: checkpoints, each a header with a checksum, then the content.

use std::fs::{self, File};
use std::io::Write as _;
use std::path::{Path, PathBuf};

use crate::DiskError;
use crate::beside::{Beside, folder_of};
use crate::left_behind::CHECKPOINT;
use crate::work_folder::WorkFolder;

const MAGIC: [u8; 8] = *b"DMPCHECK";
const VERSION: u32 = 3;
/// Magic, version, CRC-32 of what follows it, length of the content.
const HEADER_BYTES: usize = 24;

impl WorkFolder {
    /// Keeps `content` under `name`, in place of what was kept there before, so that it survives this process and
    /// a power cut: whole, or not at all.
    ///
    /// # Errors
    /// When it cannot be written; what was kept before is untouched then.
    pub fn save(&self, name: &str, content: &[u8]) -> Result<(), DiskError> {
        write_checked(&self.checkpoint(name), content)
    }

    /// What was last kept under `name`; `None` where nothing was.
    ///
    /// # Errors
    /// When it cannot be read, or is not what was written.
    pub fn load(&self, name: &str) -> Result<Option<Vec<u8>>, DiskError> {
        read_checked(&self.checkpoint(name))
    }

    /// Forgets what was kept under `name`.
    pub fn forget(&self, name: &str) {
        // What cannot be removed now goes with the folder.
        let _ = fs::remove_file(self.checkpoint(name));
    }

    /// Whether anything is kept under `name`.
    pub fn holds(&self, name: &str) -> bool {
        self.checkpoint(name).exists()
    }

    fn checkpoint(&self, name: &str) -> PathBuf {
        self.path().join(format!("{name}.{CHECKPOINT}"))
    }
}

/// Writes `content` behind a checksum to a file that survives this process and a power cut: whole, or not at all.
///
/// # Errors
/// When it cannot be written; what was there before is untouched then.
pub fn write_checked(path: &Path, content: &[u8]) -> Result<(), DiskError> {
    let io = |what| DiskError::io(path, what);
    // What a killed process left of it is removed by the next one.
    let (mut beside, mut file) = Beside::file(path).map_err(io("cannot write the file"))?;
    let written = file.write_all(&header_of(content)).and_then(|()| file.write_all(content));
    written.and_then(|()| file.sync_all()).map_err(io("cannot write the file"))?;
    beside.rename(path).map_err(io("cannot write the file"))?;
    sync_folder(folder_of(path)).map_err(io("cannot write the file"))
}

/// What [`write_checked`] wrote; `None` where there is no such file.
///
/// # Errors
/// When it cannot be read, or is not what was written.
pub fn read_checked(path: &Path) -> Result<Option<Vec<u8>>, DiskError> {
    let bytes = match fs::read(path) {
        Ok(bytes) => bytes,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(DiskError::io(path, "cannot read the file")(error)),
    };
    match content_of(&bytes) {
        Ok(content) => Ok(Some(content.to_vec())),
        Err(detail) => Err(DiskError::Damaged { path: path.into(), part: "content", detail }),
    }
}

/// The header of a content.
fn header_of(content: &[u8]) -> [u8; HEADER_BYTES] {
    let mut header = [0; HEADER_BYTES];
    header[..8].copy_from_slice(&MAGIC);
    header[8..12].copy_from_slice(&VERSION.to_le_bytes());
    header[16..].copy_from_slice(&(content.len() as u64).to_le_bytes());
    let crc32 = checksum(&header, content);
    header[12..16].copy_from_slice(&crc32.to_le_bytes());
    header
}

/// The content behind the header.
///
/// # Errors
/// What is wrong with the bytes, where they are not those of a header and its content.
fn content_of(bytes: &[u8]) -> Result<&[u8], String> {
    let Some((header, content)) = bytes.split_first_chunk::<HEADER_BYTES>() else {
        return Err(format!("{} bytes are too few for one", bytes.len()));
    };
    let word = |at: usize| u32::from_le_bytes([header[at], header[at + 1], header[at + 2], header[at + 3]]);
    if header[..8] != MAGIC || word(8) != VERSION {
        return Err(format!("it begins with {:02x?}", &header[..12]));
    }
    let (saved, calculated) = (word(12), checksum(header, content));
    if saved != calculated || header[16..] != (content.len() as u64).to_le_bytes() {
        return Err(format!("checksum {calculated:08x}, {saved:08x} was written"));
    }
    Ok(content)
}

/// Of the checksum itself nothing, of everything else all.
fn checksum(header: &[u8; HEADER_BYTES], content: &[u8]) -> u32 {
    let mut crc = crc32fast::Hasher::new();
    crc.update(&header[..12]);
    crc.update(&header[16..]);
    crc.update(content);
    crc.finalize()
}

/// A new name in a folder is safe once the folder is written.
fn sync_folder(folder: &Path) -> std::io::Result<()> {
    if cfg!(unix) { File::open(folder)?.sync_all() } else { Ok(()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_damaged_byte_of_a_checkpoint_is_found() {
        let parent = tempfile::tempdir().unwrap();
        let work = WorkFolder::new(parent.path()).unwrap();
        work.save("fuse", b"forty-two bytes of what was done so far..").unwrap();
        let path = work.file("fuse.checkpoint");
        let whole = fs::read(&path).unwrap();
        for at in 0..whole.len() {
            let mut bytes = whole.clone();
            bytes[at] ^= 0x10;
            fs::write(&path, bytes).unwrap();
            assert!(matches!(work.load("fuse"), Err(DiskError::Damaged { .. })), "byte {at}");
            fs::write(&path, &whole[..at]).unwrap();
            assert!(matches!(work.load("fuse"), Err(DiskError::Damaged { .. })), "cut at {at}");
        }
    }
}
