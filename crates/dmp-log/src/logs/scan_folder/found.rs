//! Which files of a folder are its scans.

use super::names;
use crate::LogError;
use crate::file::{files_where, is_folder, is_hidden};
use crate::logs::scan_folder::scan_file::ScanFormat;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Where in a folder the scans may be.
pub(crate) const PLACES: [&str; 4] = ["", "scans", "velodyne", "velodyne_points/data"];
/// A file of another format among so many is no scan: people keep a map beside them.
const MANY: usize = 3;

type Formats = BTreeMap<ScanFormat, Vec<PathBuf>>;

/// The files with scans of a folder, in order.
#[derive(Debug, Clone)]
pub(crate) struct FoundScans {
    pub(super) folder: PathBuf,
    pub(super) format: ScanFormat,
    pub(super) files: Vec<PathBuf>,
    pub(super) notes: Vec<String>,
}

impl FoundScans {
    /// The scans in or under `path`, where most of one format are; `None` where there are none.
    pub(crate) fn under(path: &Path) -> Result<Option<Self>, LogError> {
        let mut best: Option<(usize, PathBuf, Formats)> = None;
        for place in PLACES {
            let folder = if place.is_empty() { path.to_owned() } else { path.join(place) };
            if !is_folder(&folder)? {
                continue;
            }
            let formats = files_by_format(&folder)?;
            let most = formats.values().map(Vec::len).max().unwrap_or(0);
            // A map beside the folder with the scans is one file, they are many.
            if most > best.as_ref().map_or(0, |best| best.0) {
                best = Some((most, folder, formats));
            }
        }
        best.map(|(_, folder, formats)| choose(folder, formats)).transpose()
    }

    pub(crate) fn len(&self) -> usize {
        self.files.len()
    }
}

fn files_by_format(folder: &Path) -> Result<Formats, LogError> {
    let mut formats = Formats::new();
    for file in files_where(folder, |file| !is_hidden(file) && ScanFormat::of(file).is_some())? {
        if let Some(format) = ScanFormat::of(&file) {
            formats.entry(format).or_default().push(file);
        }
    }
    Ok(formats)
}

fn choose(folder: PathBuf, formats: Formats) -> Result<FoundScans, LogError> {
    let counts = |formats: &Formats| {
        let count = |(format, files): (&ScanFormat, &Vec<PathBuf>)| {
            format!("{} {}", files.len(), format.extensions())
        };
        formats.iter().map(count).collect::<Vec<_>>().join(", ")
    };
    let mut several = formats;
    let most =
        several.iter().max_by_key(|(_, files)| files.len()).map(|(&format, files)| (format, files.len()));
    let others_are_single = several.values().filter(|files| files.len() > 1).count() == 1;
    match most {
        Some((format, count)) if several.len() == 1 || (others_are_single && count >= MANY) => {
            let mut files = several.remove(&format).unwrap_or_default();
            let mut notes = Vec::new();
            if !several.is_empty() {
                notes.push(format!("ignored, as they are no scans: {}", counts(&several)));
            }
            notes.push(names::put_in_order(&mut files).into());
            Ok(FoundScans { folder, format, files, notes })
        }
        _ => {
            let problem =
                format!("scans of several formats: {}; leave those of one in the folder", counts(&several));
            Err(LogError::Option { path: folder, problem })
        }
    }
}
