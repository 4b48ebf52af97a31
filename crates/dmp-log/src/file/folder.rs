//! What a folder holds.

use crate::LogError;
use dmp_disk::open_input;
use std::fs::{self, Metadata};
use std::io::ErrorKind;
use std::path::{Component, Path, PathBuf};

/// The files and folders in a folder, in no order.
pub(crate) fn entries(folder: &Path) -> Result<Vec<PathBuf>, LogError> {
    let entries = fs::read_dir(folder).map_err(|e| LogError::io(folder, "open", e))?;
    entries.map(|entry| Ok(entry.map_err(|e| LogError::io(folder, "read", e))?.path())).collect()
}

/// The files in a folder that have an extension, in letters of this size, sorted by name.
pub(crate) fn files_with_extension(folder: &Path, extension: &str) -> Result<Vec<PathBuf>, LogError> {
    let mut files = files_where(folder, |file| file.extension().is_some_and(|found| found == extension))?;
    files.sort();
    Ok(files)
}

/// The files in a folder with such names, in no order.
pub(crate) fn files_where(
    folder: &Path,
    is_wanted: impl Fn(&Path) -> bool,
) -> Result<Vec<PathBuf>, LogError> {
    let mut files = Vec::new();
    for file in entries(folder)? {
        if is_wanted(&file) && is_file(&file)? {
            files.push(file);
        }
    }
    Ok(files)
}

/// Whether there is a file at a path. What cannot be looked at, and a pipe in the place of a file, is an error: without it, what is
/// read would mean something else.
pub(crate) fn is_file(path: &Path) -> Result<bool, LogError> {
    let Some(found) = found(path)? else { return Ok(false) };
    #[cfg(unix)]
    if std::os::unix::fs::FileTypeExt::is_fifo(&found.file_type()) {
        open_input(path).map_err(|e| LogError::io(path, "open", e))?;
    }
    Ok(found.is_file())
}

pub(crate) fn is_folder(path: &Path) -> Result<bool, LogError> {
    Ok(found(path)?.is_some_and(|found| found.is_dir()))
}

pub(crate) fn first_file(paths: impl IntoIterator<Item = PathBuf>) -> Result<Option<PathBuf>, LogError> {
    for path in paths {
        if is_file(&path)? {
            return Ok(Some(path));
        }
    }
    Ok(None)
}

fn found(path: &Path) -> Result<Option<Metadata>, LogError> {
    use ErrorKind::{InvalidFilename, InvalidInput, NotADirectory, NotFound};
    match fs::metadata(path) {
        Ok(found) => Ok(Some(found)),
        // Nothing is there, or nothing can be of that name.
        Err(error) if matches!(error.kind(), NotFound | NotADirectory | InvalidFilename | InvalidInput) => {
            Ok(None)
        }
        Err(error) => Err(LogError::io(path, "open", error)),
    }
}

/// Whether a file begins with a full stop: some systems put such files beside each copied one.
pub(crate) fn is_hidden(file: &Path) -> bool {
    file.file_name().is_some_and(|name| name.as_encoded_bytes().starts_with(b"."))
}

/// Whether a path that a file names stays in that file's folder, however it is written.
pub(crate) fn stays_inside(path: &Path) -> bool {
    path.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn what_cannot_be_looked_at_is_not_missing() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        fs::write(path("there"), b"").unwrap();
        // A link to itself: the system says neither that it is a file nor that it is none.
        std::os::unix::fs::symlink("loop", path("loop")).unwrap();
        assert!(is_file(&path("there")).unwrap() && !is_file(&path("nowhere")).unwrap());
        assert!(!is_file(&path("there/inside")).unwrap() && !is_file(&path(&"n".repeat(300))).unwrap());
        assert!(is_folder(folder.path()).unwrap());
        assert!(is_file(&path("loop")).is_err() && files_where(folder.path(), |_| true).is_err());
        assert!(first_file(["nowhere", "loop", "there"].map(path)).is_err());
        assert_eq!(first_file(["nowhere", "there"].map(path)).unwrap(), Some(path("there")));
    }
}
