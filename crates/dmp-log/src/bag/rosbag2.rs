//! Folders as rosbag2 writes them.

use crate::LogError;
use crate::open::files_with_extension;
use std::path::{Path, PathBuf};

/// The bag's files in a folder, in order; `None` where there are none.
pub(super) fn files_of(folder: &Path) -> Result<Option<Vec<PathBuf>>, LogError> {
    let files = files_with_extension(folder, "mcap")?;
    match files.len() {
        0 => Ok(None),
        1 => Ok(Some(files)),
        several => {
            let problem = format!("{several} MCAP files in the folder: name one of them");
            Err(LogError::Option { path: folder.into(), problem })
        }
    }
}
