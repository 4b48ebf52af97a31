//! What is on disk only until it is finished, for a process that must end at once.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::left_behind::has_checkpoint;

static UNFINISHED: Mutex<Vec<Begun>> = Mutex::new(Vec::new());
/// How often a folder is emptied while others still write in it.
const TRIES: u32 = 10;

/// What was begun.
pub(crate) struct Begun {
    path: PathBuf,
    /// Whether it goes only where nothing is in it.
    if_empty: bool,
}

/// A file or folder that [`remove_unfinished`] removes until this is dropped.
#[derive(Debug)]
pub struct Unfinished(PathBuf);

impl Unfinished {
    /// `path` is on disk, or will be.
    pub fn new(path: &Path) -> Self {
        all().push(Begun { path: path.into(), if_empty: false });
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
        all.push(Begun { path: path.clone(), if_empty: false });
        Ok((Self(path), made))
    }

    /// Makes a folder that is removed only where nothing is in it.
    ///
    /// # Errors
    /// When it cannot be made, as when it is there.
    pub fn make_folder(path: &Path) -> io::Result<Self> {
        let mut all = all();
        fs::create_dir(path)?;
        all.push(Begun { path: path.into(), if_empty: true });
        Ok(Self(path.into()))
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.0
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        let mut all = all();
        if let Some(k) = all.iter().position(|begun| begun.path == self.0) {
            // By their order, which folders are in which.
            all.remove(k);
        }
    }
}

/// Removes what this process has begun and not finished, except work folders with a checkpoint, which can be resumed, and
/// returns those: the last that it does, whatever its other threads are at. Nothing can be begun or finished afterwards.
pub fn remove_unfinished() -> Vec<PathBuf> {
    let all = all();
    let (folders, whole): (Vec<&Begun>, Vec<&Begun>) = all.iter().partition(|begun| begun.if_empty);
    let stays = |path: &&Path| path.is_dir() && has_checkpoint(path);
    let (kept, gone): (Vec<&Path>, Vec<&Path>) =
        whole.iter().map(|begun| begun.path.as_path()).partition(stays);
    for path in gone {
        for _ in 0..TRIES {
            if fs::remove_file(path).or_else(|_| fs::remove_dir_all(path)).is_ok() || !path.exists() {
                break;
            }
        }
    }
    // Inner ones last made, and what was unfinished in them is gone.
    for folder in folders.iter().rev() {
        let _ = fs::remove_dir(&folder.path);
    }
    let kept = kept.into_iter().map(Path::to_path_buf).collect();
    // Keeps the lock: a thread that got it now would leave something behind.
    std::mem::forget(all);
    kept
}

/// What was begun. While it is held, [`remove_unfinished`] waits.
pub(crate) fn all() -> MutexGuard<'static, Vec<Begun>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}
