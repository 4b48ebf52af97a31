//! Work folders that processes left behind: which can be resumed, and removing the others.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crate::folder_lock::{LOCK, is_own_folder, open_lock};

/// Every work folder's name begins so.
pub(crate) const PREFIX: &str = "dmp-work-";
/// Ends the name of a checkpoint.
pub(crate) const CHECKPOINT: &str = "checkpoint";

/// Whether there is something to go on from, or may be: a folder that cannot be looked into is not removed.
pub(crate) fn has_checkpoint(folder: &Path) -> bool {
    match fs::read_dir(folder) {
        Ok(mut entries) => entries.any(|entry| entry.map_or(true, |entry| is_checkpoint(&entry.path()))),
        Err(error) => error.kind() != io::ErrorKind::NotFound,
    }
}

/// This user's folders of such names.
pub(crate) fn own_folders(parent: &Path, prefix: &str) -> impl Iterator<Item = PathBuf> {
    let entries = fs::read_dir(parent).into_iter().flatten().flatten();
    let named =
        entries.filter(move |entry| entry.file_name().to_str().is_some_and(|name| name.starts_with(prefix)));
    named.map(|entry| entry.path()).filter(|path| is_own_folder(path))
}

/// Removes the folders of killed processes that hold no checkpoint. A folder that cannot be read is left alone.
pub(crate) fn sweep(parent: &Path) {
    for folder in own_folders(parent, PREFIX).filter(|folder| !has_checkpoint(folder)) {
        match open_lock(&folder.join(LOCK), false) {
            Ok(lock) if lock.try_lock().is_ok() => {
                // Its process may have made a checkpoint and ended since it was looked at.
                if !has_checkpoint(&folder) {
                    remove(&folder);
                }
                // Closing it would not do: a process that another thread starts just now holds a copy of it.
                let _ = lock.unlock();
            }
            // Its process was killed before it had a lock, or is about to make one: then it makes another folder.
            Err(error) if error.kind() == io::ErrorKind::NotFound => drop(fs::remove_dir(&folder)),
            _ => {}
        }
    }
}

/// Removes a folder, in an order that shows what is left where that ends midway: the checkpoints first, so that no
/// process resumes without the rest, and the lock last, so that the next process removes the rest.
pub(crate) fn remove(folder: &Path) {
    let files = || fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    // What cannot be removed stays; there is no caller to report it to.
    let _: Vec<_> = files().filter(|path| is_checkpoint(path)).map(fs::remove_file).collect();
    let _: Vec<_> = files().filter(|path| !path.ends_with(LOCK)).map(fs::remove_file).collect();
    let _ = fs::remove_dir_all(folder);
}

pub(crate) fn is_checkpoint(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == CHECKPOINT)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Killed after it made its folder, or midway through removing it.
    #[test]
    fn folders_without_a_lock_or_half_removed_go_too() {
        let parent = tempfile::tempdir().unwrap();
        let left = ["dmp-work-new", "dmp-work-old"].map(|name| parent.path().join(name));
        left.iter().for_each(|folder| fs::create_dir(folder).unwrap());
        fs::write(left[1].join(LOCK), b"").unwrap();
        fs::write(left[1].join("a.scratch"), b"half").unwrap();
        // One that is not empty is not ours to judge.
        let other = parent.path().join("dmp-work-other");
        fs::create_dir(&other).unwrap();
        fs::write(other.join("map"), b"whose?").unwrap();
        sweep(parent.path());
        assert!(left.iter().all(|folder| !folder.exists()) && other.join("map").exists());
    }
}
