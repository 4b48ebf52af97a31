//! What lies in a folder.

use std::path::Path;

use crate::DiskError;

/// The names of the files in a folder, in order; names that are no text are skipped.
///
/// # Errors
/// When the folder cannot be read.
pub fn file_names(folder: &Path) -> Result<Vec<String>, DiskError> {
    let io = |error| DiskError::io(folder, "cannot read the folder")(error);
    let mut names = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(io)? {
        names.extend(entry.map_err(io)?.file_name().into_string());
    }
    names.sort_unstable();
    Ok(names)
}
