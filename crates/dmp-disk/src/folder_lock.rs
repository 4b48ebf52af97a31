//! Folders of one's own, and their locks: held by the process that works in one.
//!
//! The folder for temporary files is everybody's. What others may have put there is never opened, followed or waited for.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io;
use std::path::Path;

use crate::DiskError;

/// The file that is locked.
pub(crate) const LOCK: &str = "lock";

/// Locks a folder, as long as the file is held.
///
/// # Errors
/// When the lock cannot be made, is no file, or another process has it.
pub(crate) fn lock_folder(folder: &Path) -> Result<File, DiskError> {
    let lock = open_lock(&folder.join(LOCK), true);
    let lock = lock.map_err(DiskError::io(folder, "cannot make a lock in the work folder"))?;
    match lock.try_lock() {
        Err(TryLockError::WouldBlock) => return Err(DiskError::Locked { path: folder.to_path_buf() }),
        // Where a file system has no locks, the folder's name must do.
        Ok(()) | Err(TryLockError::Error(_)) => {}
    }
    let is_at = is_at(&lock, &folder.join(LOCK));
    if !is_at.map_err(DiskError::io(folder, "cannot make a lock in the work folder"))? {
        return Err(DiskError::Locked { path: folder.to_path_buf() });
    }
    Ok(lock)
}

/// Opens a file to lock it: neither through a link, nor waiting at a pipe.
pub(crate) fn open_lock(path: &Path, make: bool) -> io::Result<File> {
    let mut options = OpenOptions::new();
    options.write(true).create(make).truncate(false);
    #[cfg(unix)]
    {
        use std::os::unix::fs::OpenOptionsExt as _;
        let flags = rustix::fs::OFlags::NOFOLLOW | rustix::fs::OFlags::NONBLOCK;
        options.custom_flags(flags.bits().cast_signed());
    }
    let lock = options.open(path)?;
    if !lock.metadata()?.is_file() {
        return Err(io::Error::other("what is to be locked is no file"));
    }
    Ok(lock)
}

/// Whether a path is that of a folder, no link, that is this user's and that no other user may write in.
pub fn is_own_folder(path: &Path) -> bool {
    let Ok(found) = fs::symlink_metadata(path) else { return false };
    found.is_dir() && is_own(&found) && !is_writable_by_others(&found)
}

/// Whether a link may be followed: not where everybody may put links and another user has (as Linux'
/// `fs.protected_symlinks` has it, which checks only folders in which users cannot remove each other's files).
pub(crate) fn may_follow(link: &Path, folder: &Path) -> bool {
    let (Ok(link), Ok(folder)) = (fs::symlink_metadata(link), fs::metadata(folder)) else { return false };
    is_own(&link) || !is_everybodys(&folder) || is_of_same_owner(&link, &folder)
}

#[cfg(unix)]
fn is_own(found: &fs::Metadata) -> bool {
    std::os::unix::fs::MetadataExt::uid(found) == rustix::process::geteuid().as_raw()
}

#[cfg(unix)]
fn is_writable_by_others(found: &fs::Metadata) -> bool {
    std::os::unix::fs::MetadataExt::mode(found) & 0o022 != 0
}

/// Everybody writes in it.
#[cfg(unix)]
fn is_everybodys(folder: &fs::Metadata) -> bool {
    std::os::unix::fs::MetadataExt::mode(folder) & 0o002 != 0
}

#[cfg(unix)]
fn is_of_same_owner(a: &fs::Metadata, b: &fs::Metadata) -> bool {
    use std::os::unix::fs::MetadataExt as _;
    a.uid() == b.uid()
}

#[cfg(not(unix))]
fn is_own(_: &fs::Metadata) -> bool {
    true
}

#[cfg(not(unix))]
fn is_writable_by_others(_: &fs::Metadata) -> bool {
    false
}

#[cfg(not(unix))]
fn is_everybodys(_: &fs::Metadata) -> bool {
    false
}

#[cfg(not(unix))]
fn is_of_same_owner(_: &fs::Metadata, _: &fs::Metadata) -> bool {
    true
}

/// Whether an open file is the one at this path: another process may have removed it before it was locked.
pub(crate) fn is_at(file: &File, path: &Path) -> io::Result<bool> {
    let open = file.metadata()?;
    Ok(there(fs::metadata(path))?.is_some_and(|there| same_file(&open, &there)))
}

/// What was found at a path; `None` where there is nothing. What cannot be read is an error: it may be there.
pub(crate) fn there(found: io::Result<fs::Metadata>) -> io::Result<Option<fs::Metadata>> {
    match found {
        Ok(found) => Ok(Some(found)),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(error),
    }
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
