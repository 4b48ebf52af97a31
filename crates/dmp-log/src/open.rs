use crate::bag::Bag;
use crate::bag_log::BagLog;
use crate::folder::BinFolder;
use crate::{LogError, LogOptions, ScanLog};
use std::fs::{self, File};
use std::io::Read;
use std::path::{Path, PathBuf};

const LOOKED_FOR: &str = "looked for an MCAP file or for a folder with .bin scans";

/// Opens the log at `path`: an MCAP file, a folder with one, or a folder of `.bin` scans.
///
/// Opening reads an MCAP file once from start to end and takes stock of what is damaged; of a folder it
/// reads the lengths of the files.
///
/// # Errors
/// When there is nothing at the path, when it is in no format known here, when the choice of a topic or
/// the meaning of the times is left open, and when there is no scan in it. Damage to a part is no error,
/// see [`crate::LogSummary::damage`].
pub fn open_log(path: &Path, options: &LogOptions) -> Result<Box<dyn ScanLog>, LogError> {
    let metadata = fs::metadata(path).map_err(|e| LogError::io(path, "open", e))?;
    if metadata.is_dir() {
        return open_folder(path, options);
    }
    let mut start = Vec::new();
    let file = File::open(path).map_err(|e| LogError::io(path, "open", e))?;
    file.take(16).read_to_end(&mut start).map_err(|e| LogError::io(path, "read", e))?;
    if let Some(bag) = Bag::of_file(path, &start) {
        return Ok(Box::new(BagLog::open(bag, options)?));
    }
    let looked_for = format!("{LOOKED_FOR}; the file starts with {start:02x?}");
    Err(LogError::UnknownFormat { path: path.into(), looked_for })
}

fn open_folder(path: &Path, options: &LogOptions) -> Result<Box<dyn ScanLog>, LogError> {
    if let Some(folder) = BinFolder::open(path, options)? {
        return Ok(Box::new(folder));
    }
    if let Some(bag) = Bag::of_folder(path)? {
        return Ok(Box::new(BagLog::open(bag, options)?));
    }
    let looked_for = format!(
        "{LOOKED_FOR} (in it, in scans/, velodyne/ or velodyne_points/data/); the folder has neither"
    );
    Err(LogError::UnknownFormat { path: path.into(), looked_for })
}

/// The files in a folder with an extension, sorted by name.
pub(crate) fn files_with_extension(folder: &Path, extension: &str) -> Result<Vec<PathBuf>, LogError> {
    let entries = fs::read_dir(folder).map_err(|e| LogError::io(folder, "open", e))?;
    let mut files = Vec::new();
    for entry in entries {
        let file = entry.map_err(|e| LogError::io(folder, "read", e))?.path();
        if file.extension().is_some_and(|found| found == extension) && file.is_file() {
            files.push(file);
        }
    }
    files.sort();
    Ok(files)
}
