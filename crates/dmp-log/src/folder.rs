//! What a folder holds.

use crate::LogError;
use std::fs;
use std::path::{Component, Path, PathBuf};

/// The files and folders in a folder, in no order.
pub(crate) fn entries(folder: &Path) -> Result<Vec<PathBuf>, LogError> {
    let entries = fs::read_dir(folder).map_err(|e| LogError::io(folder, "open", e))?;
    entries.map(|entry| Ok(entry.map_err(|e| LogError::io(folder, "read", e))?.path())).collect()
}

/// The files in a folder that have an extension, in letters of this size, sorted by name.
pub(crate) fn files_with_extension(folder: &Path, extension: &str) -> Result<Vec<PathBuf>, LogError> {
    let mut files = entries(folder)?;
    files.retain(|file| file.extension().is_some_and(|found| found == extension) && file.is_file());
    files.sort();
    Ok(files)
}

/// Whether a file begins with a full stop: some systems put such files beside each copied one.
pub(crate) fn is_hidden(file: &Path) -> bool {
    file.file_name().is_some_and(|name| name.as_encoded_bytes().starts_with(b"."))
}

/// Whether a path that a file names stays in that file's folder, however it is written.
pub(crate) fn stays_inside(path: &Path) -> bool {
    path.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir))
}
