//! What is read with an input without being named: files beside it, files in it.

use super::depth_folder::IMAGE_LISTS;
use super::scan_folder::{LISTS, PLACES};
use crate::file::{entries, is_folder};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

/// Files of one thing that lie beside others, in the folder of these or above it.
const SINGLE: [&str; 3] = ["calib.txt", "camera.json", "metadata.yaml"];
/// What `SQLite` keeps beside a database and reads with it.
const OF_DATABASES: [&str; 3] = ["-journal", "-wal", "-shm"];
/// Extensions of the files that a folder is read by.
const EXTENSIONS: [&str; 13] = [
    "bag",
    "bin",
    "pcd",
    "ply",
    "las",
    "laz",
    "mcap",
    "db3",
    "db3-journal",
    "db3-wal",
    "db3-shm",
    "png",
    "f32",
];

/// What the readers look for beside an input and in it, whether it is there or not. Rather too much than too little: for
/// who must not write there.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Companions {
    /// Single files.
    pub files: Vec<PathBuf>,
    /// Folders of which all files that [`is_of_log`] are read.
    pub folders: Vec<PathBuf>,
}

impl Companions {
    /// Those of a file: the stamps of a trajectory, the calibration, what belongs to a bag.
    pub fn of_file(path: &Path) -> Self {
        let mut files = Vec::new();
        for path in ways_to(path) {
            files.extend(OF_DATABASES.map(|end| {
                let mut name = path.clone().into_os_string();
                name.push(end);
                PathBuf::from(name)
            }));
            let folder = path.parent().unwrap_or(&path);
            files.extend(["times.txt", "calib.txt", "metadata.yaml"].map(|name| folder.join(name)));
            files.extend(folder.parent().map(|above| above.join("calib.txt")));
        }
        Self { files, folders: Vec::new() }
    }

    /// Those of a folder, which need not be there yet: scans, images or a bag in it, and what is said of them there and above.
    pub fn of_folder(path: &Path) -> Self {
        let mut found = Self::default();
        for path in ways_to(path) {
            let mut places: Vec<PathBuf> = PLACES.iter().map(|place| path.join(place)).collect();
            let named_depth = |place: &PathBuf| {
                let name = place.file_name().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
                name.contains("depth") && is_folder(place).unwrap_or(true)
            };
            places.push(path.join("depth"));
            places.extend(entries(&path).unwrap_or_default().into_iter().filter(named_depth));
            let mut around = places.clone();
            around.extend(path.parent().map(Path::to_path_buf));
            around.push(path.join("velodyne_points"));
            for folder in &around {
                let names = SINGLE.iter().chain(&LISTS).chain(&IMAGE_LISTS);
                found.files.extend(names.map(|name| folder.join(name)));
                found.folders.push(folder.join("times"));
            }
            found.folders.append(&mut places);
        }
        found
    }
}

/// Whether a file of this name, in a folder that is read, is taken for a part of the log.
pub fn is_of_log(name: &Path) -> bool {
    let extension = name.extension().and_then(OsStr::to_str);
    extension.is_some_and(|found| EXTENSIONS.iter().any(|known| found.eq_ignore_ascii_case(known)))
}

/// A path from the root as it is written, and the same without links: some readers look beside the one, some beside the
/// other.
fn ways_to(path: &Path) -> Vec<PathBuf> {
    let mut ways: Vec<PathBuf> =
        [std::path::absolute(path), path.canonicalize()].into_iter().flatten().collect();
    ways.dedup();
    ways
}
