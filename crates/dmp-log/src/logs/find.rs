//! What lies at a path: a bag, a folder of scans or of depth images, or a LAS file.

use super::depth_folder::FoundImages;
use super::scan_folder::FoundScans;
use crate::file::{is_file, start_of};
use crate::messages::Bag;
use crate::{LogError, LogOptions, LogSetting};
use std::fs;
use std::path::Path;

const LOOKED_FOR: &str = "looked for an MCAP file, a rosbag2 file or folder, a ROS 1 bag, a LAS or LAZ file, or a folder with one scan a file (.bin, \
                          .pcd, .ply, .las, .laz) or depth images (depth.txt, depth/*.png)";

/// The first bytes of a ROS 1 bag of any version, and what to do with an old one.
pub(crate) const ROS1_MAGIC: &[u8] = b"#ROSBAG V";
pub(crate) const ROS1_ADVICE: &str =
    "a ROS 1 bag older than version 2.0: write it anew with `rosbag filter OLD.bag NEW.bag True`";

/// Whether a file is named as a bag is (`.mcap`, `.db3`, `.bag`), whether it is there or not.
pub fn has_bag_name(path: &Path) -> bool {
    let extension = path.extension().unwrap_or_default();
    ["mcap", "db3", "bag"].iter().any(|known| extension.eq_ignore_ascii_case(known))
}

pub(crate) enum Found {
    Bag(Bag),
    Folder(FoundScans),
    Depth(FoundImages),
    /// A LAS or LAZ file.
    Las,
}

pub(crate) fn bag_at(path: &Path) -> Result<Option<Bag>, LogError> {
    match find(path) {
        Ok(Found::Bag(bag)) => Ok(Some(bag)),
        Ok(_) | Err(LogError::UnknownFormat { .. }) => Ok(None),
        Err(error) => Err(error),
    }
}

/// The log at a path, for which the options make sense.
pub(crate) fn find_for(path: &Path, options: &LogOptions) -> Result<Found, LogError> {
    let found = find(path)?;
    check_in_sensor_frame(path, &found, options)?;
    Ok(found)
}

fn find(path: &Path) -> Result<Found, LogError> {
    let metadata = fs::metadata(path).map_err(|e| LogError::io(path, "open", e))?;
    if metadata.is_dir() {
        return find_in_folder(path);
    }
    let start = start_of(path)?;
    if start.starts_with(b"LASF") {
        return Ok(Found::Las);
    }
    if let Some(bag) = Bag::of_file(path, &start) {
        return Ok(Found::Bag(bag));
    }
    let looked_for = if start.starts_with(ROS1_MAGIC) {
        ROS1_ADVICE.to_owned()
    } else if start.starts_with(&[0x28, 0xb5, 0x2f, 0xfd]) {
        "packed with zstd: unpack it with `zstd -d FILE`".to_owned()
    } else if start.starts_with(&[0x1f, 0x8b]) {
        "packed with gzip: unpack it with `gunzip FILE`".to_owned()
    } else if path.file_name().is_some_and(|name| name == "metadata.yaml") {
        "what describes a rosbag2 folder: name the folder that it is in".to_owned()
    } else {
        format!("{LOOKED_FOR}; the file starts with {start:02x?}")
    };
    Err(LogError::UnknownFormat { path: path.into(), looked_for })
}

fn find_in_folder(path: &Path) -> Result<Found, LogError> {
    // What rosbag2 describes is a bag, whatever lies beside it.
    if is_file(&path.join("metadata.yaml"))?
        && let Some(bag) = Bag::of_folder(path)?
    {
        return Ok(Found::Bag(bag));
    }
    // So are images that a list names.
    if let Some(images) = FoundImages::listed(path)? {
        return Ok(Found::Depth(images));
    }
    let scans = FoundScans::under(path)?;
    // A single file beside a bag is a map.
    if scans.as_ref().is_none_or(|scans| scans.len() < 2)
        && let Some(bag) = Bag::of_folder(path)?
    {
        return Ok(Found::Bag(bag));
    }
    let found = scans.as_ref().map_or(0, FoundScans::len);
    // Beside depth images too a single file is a map; and a single image beside it is a picture of something.
    if found < 2
        && let Some(images) = FoundImages::in_folder(path)?
        && images.len() > found
    {
        return Ok(Found::Depth(images));
    }
    if let Some(scans) = scans {
        return Ok(Found::Folder(scans));
    }
    let looked_for = format!(
        "{LOOKED_FOR} (in it, in scans/, velodyne/ or velodyne_points/data/); the folder has neither"
    );
    Err(LogError::UnknownFormat { path: path.into(), looked_for })
}

fn check_in_sensor_frame(path: &Path, found: &Found, options: &LogOptions) -> Result<(), LogError> {
    if options.made_with.is_none() || matches!(found, Found::Las) {
        return Ok(());
    }
    let problem = "was given, but it is for one LAS or LAZ file in world coordinates (several have to be merged into one)";
    Err(LogError::setting(path, LogSetting::MadeWith, "", problem))
}
