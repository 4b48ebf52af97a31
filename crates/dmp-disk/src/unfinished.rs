//! What is on disk only until it is finished, for a process that must end at once.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::left_behind::has_checkpoint;

static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());
/// How often a folder is emptied while others still write in it.
const TRIES: u32 = 10;

/// A file or folder that [`remove_unfinished`] removes until this is dropped.
#[derive(Debug)]
pub struct Unfinished(PathBuf);

impl Unfinished {
    /// `path` is on disk, or will be.
    pub fn new(path: &Path) -> Self {
        all().push(path.into());
        Self(path.into())
    }

    /// Makes something on disk, which `make` gives with its path. No process ends between the two: whatever is made is
    /// removed. `make` begins nothing else that is unfinished; it would wait for itself.
    ///
    /// # Errors
    /// Those of `make`.
    pub fn make<T, E>(make: impl FnOnce() -> Result<(PathBuf, T), E>) -> Result<(Self, T), E> {
        let mut all = all();
        let (path, made) = make()?;
        all.push(path.clone());
        Ok((Self(path), made))
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.0
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        let mut all = all();
        if let Some(k) = all.iter().position(|path| *path == self.0) {
            all.swap_remove(k);
        }
    }
}

/// Removes what this process has begun and not finished, but for work folders with a checkpoint, which can be gone on from:
/// the last that it does, whatever its other threads are at. Nothing can be begun or finished afterwards.
pub fn remove_unfinished() {
    let all = all();
    for path in all.iter().filter(|path| !(path.is_dir() && has_checkpoint(path))) {
        for _ in 0..TRIES {
            if fs::remove_file(path).or_else(|_| fs::remove_dir_all(path)).is_ok() || !path.exists() {
                break;
            }
        }
    }
    // Who waits for it now would leave something behind.
    std::mem::forget(all);
}

fn all() -> MutexGuard<'static, Vec<PathBuf>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}
