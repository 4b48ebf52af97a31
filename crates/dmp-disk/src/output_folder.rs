//! Folders of the user's that appear whole or not at all.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crate::beside::{Beside, flush_folder};
use crate::folder_lock::there;

/// A folder under a name of its own beside its target, where there must be nothing yet; removed unless it is committed.
#[derive(Debug)]
pub struct OutputFolder {
    beside: Beside,
    target: PathBuf,
}

impl OutputFolder {
    /// A new folder that will be `target`.
    ///
    /// # Errors
    /// When there is something already, and when nothing can be made beside it.
    pub fn create(target: &Path) -> io::Result<Self> {
        if target.file_name().is_none() {
            return Err(io::Error::new(io::ErrorKind::InvalidInput, "a path to write to needs a name"));
        }
        if there(target.symlink_metadata())?.is_some() {
            let problem = "there is something already, it is not overwritten";
            return Err(io::Error::new(io::ErrorKind::AlreadyExists, problem));
        }
        Ok(Self { beside: Beside::folder(target)?, target: target.into() })
    }

    /// Where its files are made.
    pub fn path(&self) -> &Path {
        self.beside.path()
    }

    /// What it will be.
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// Gives it its name. What is in it must have been brought to disk.
    ///
    /// # Errors
    /// When it cannot be renamed.
    pub fn commit(mut self) -> io::Result<()> {
        // The names in it and in its folders.
        for entry in fs::read_dir(self.path())? {
            let entry = entry?;
            if entry.file_type()?.is_dir() {
                flush_folder(&entry.path().join("any"))?;
            }
        }
        flush_folder(&self.path().join("any"))?;
        self.beside.rename(&self.target)?;
        flush_folder(&self.target)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_is_there_whole_or_not_at_all() {
        let parent = tempfile::tempdir().unwrap();
        let target = parent.path().join("drive");
        let left = parent.path().join(".drive.Ab3xYz.dmp-tmp");
        fs::create_dir(&left).unwrap();
        fs::write(left.join("half"), b"half").unwrap();
        let folder = OutputFolder::create(&target).unwrap();
        fs::write(folder.path().join("a"), b"a").unwrap();
        assert!(!target.exists() && !left.exists());
        drop(folder);
        assert_eq!(fs::read_dir(parent.path()).unwrap().count(), 0);
        let folder = OutputFolder::create(&target).unwrap();
        fs::write(folder.path().join("a"), b"a").unwrap();
        folder.commit().unwrap();
        assert_eq!(fs::read(target.join("a")).unwrap(), b"a");
        assert!(OutputFolder::create(&target).is_err());
    }
}
