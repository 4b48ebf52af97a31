//! Files that appear whole or not at all.

use crate::LogError;
use std::fs::{self, File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

/// A file or folder under a temporary name beside its target; removed again unless committed.
#[derive(Debug)]
pub(crate) struct Pending {
    temporary: PathBuf,
    target: PathBuf,
    committed: bool,
}

impl Pending {
    fn new(target: &Path) -> Result<Self, LogError> {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let Some(name) = target.file_name() else {
            let problem = "a path to write to needs a name".to_owned();
            return Err(LogError::Option { path: target.into(), problem });
        };
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        let name = format!(".{}.{}-{count}.tmp", name.to_string_lossy(), std::process::id());
        Ok(Self { temporary: target.with_file_name(name), target: target.into(), committed: false })
    }

    /// A new file that will be `target`.
    pub(crate) fn file(target: &Path) -> Result<(Self, File), LogError> {
        Self::make(target, |temporary| OpenOptions::new().write(true).create_new(true).open(temporary))
    }

    /// A new folder that will be `target`, where there must be nothing yet.
    pub(crate) fn folder(target: &Path) -> Result<Self, LogError> {
        if target.exists() {
            let problem = "there is something already, it is not overwritten".to_owned();
            return Err(LogError::Option { path: target.into(), problem });
        }
        Ok(Self::make(target, |temporary| fs::create_dir(temporary))?.0)
    }

    /// Makes what is to be `target` under a temporary name that nothing has yet: what a killed program left, or
    /// another one is writing, is never touched.
    fn make<T>(target: &Path, make: impl Fn(&Path) -> io::Result<T>) -> Result<(Self, T), LogError> {
        loop {
            let mut pending = Self::new(target)?;
            match make(&pending.temporary) {
                Ok(made) => return Ok((pending, made)),
                Err(error) => {
                    // It is not ours to remove.
                    pending.committed = true;
                    if error.kind() != io::ErrorKind::AlreadyExists {
                        return Err(LogError::io(&pending.temporary, "create", error));
                    }
                }
            }
        }
    }

    pub(crate) fn path(&self) -> &Path {
        &self.temporary
    }

    pub(crate) fn target(&self) -> &Path {
        &self.target
    }

    /// Gives the target its name. What is under it must have been synchronised.
    pub(crate) fn commit(mut self) -> Result<(), LogError> {
        fs::rename(&self.temporary, &self.target).map_err(|e| LogError::io(&self.target, "rename to", e))?;
        self.committed = true;
        // The new name is safe once the folder is; where folders cannot be opened this is best effort.
        let folder = self.target.parent().filter(|folder| !folder.as_os_str().is_empty());
        if let Ok(folder) = File::open(folder.unwrap_or(Path::new("."))) {
            let _ = folder.sync_all();
        }
        Ok(())
    }
}

impl Drop for Pending {
    fn drop(&mut self) {
        if !self.committed {
            // Nothing to report to, and a leftover temporary is never read.
            let _ = fs::remove_file(&self.temporary);
            let _ = fs::remove_dir_all(&self.temporary);
        }
    }
}
