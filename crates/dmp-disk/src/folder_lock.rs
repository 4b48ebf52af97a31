//! The lock of a work folder: held by the process that works in it.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::path::Path;

use crate::DiskError;

/// The file that is locked.
pub(crate) const LOCK: &str = "lock";

/// Locks a folder, as long as the file is held.
///
/// # Errors
/// When the lock cannot be made, or another process has it.
pub(crate) fn lock_folder(folder: &Path) -> Result<File, DiskError> {
    let lock = OpenOptions::new().create(true).truncate(false).write(true).open(folder.join(LOCK));
    let lock = lock.map_err(DiskError::io(folder, "cannot make a lock in the work folder"))?;
    match lock.try_lock() {
        Err(TryLockError::WouldBlock) => return Err(DiskError::Locked { path: folder.to_path_buf() }),
        // Where a file system has no locks, the folder's name must do.
        Ok(()) | Err(TryLockError::Error(_)) => {}
    }
    if !is_at(&lock, &folder.join(LOCK)) {
        return Err(DiskError::Locked { path: folder.to_path_buf() });
    }
    Ok(lock)
}

/// Whether an open file is the one at this path: another process may have removed it before it was locked.
pub(crate) fn is_at(file: &File, path: &Path) -> bool {
    let Ok((open, there)) = file.metadata().and_then(|open| Ok((open, fs::metadata(path)?))) else {
        return false;
    };
    same_file(&open, &there)
}

#[cfg(unix)]
fn same_file(a: &fs::Metadata, b: &fs::Metadata) -> bool {
    use std::os::unix::fs::MetadataExt as _;
    (a.dev(), a.ino()) == (b.dev(), b.ino())
}

/// Where files have no numbers, one that is there is taken to be the same.
#[cfg(not(unix))]
fn same_file(_: &fs::Metadata, _: &fs::Metadata) -> bool {
    true
}
