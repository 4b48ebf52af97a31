//! Depth images in a folder: where they are, in which order, and what their names and stamps say they are.

use super::list::{self, Listed};
use crate::file::{entries, files_where, first_file, is_folder, is_hidden};
use crate::logs::scan_folder::names;
use crate::{LogError, LogFormat, shown_path};
use std::path::{Path, PathBuf};

/// Digits of the largest number that is a counter and no stamp.
const COUNTER_DIGITS: usize = 9;

/// The layouts of depth datasets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Layout {
    /// Stamps of a clock, in a list or as names.
    Tum,
    /// Names that count up without leading zeros, in `depth/`: stamps that count too.
    Icl,
    /// Names that count up with leading zeros: Redwood, Augmented ICL-NUIM. No stamps.
    Numbered,
    /// Any other names. No stamps, and nothing is known.
    Named,
}

/// What is usual for a layout.
pub(super) struct Usual {
    pub(super) format: LogFormat,
    pub(super) words: &'static str,
    /// Focal lengths of the dataset's camera, pixels.
    pub(super) focal_px: Option<[f64; 2]>,
    pub(super) units_per_m: Option<f64>,
}

impl Layout {
    pub(super) fn usual(self) -> Usual {
        let (format, words, focal_px, units_per_m) = match self {
            Self::Tum => (LogFormat::TumRgbd, "TUM RGB-D", Some([525.0; 2]), Some(5000.0)),
            Self::Icl => (LogFormat::IclNuim, "ICL-NUIM", Some([481.2, -480.0]), Some(5000.0)),
            Self::Numbered => {
                (LogFormat::DepthFolder, "Redwood and Augmented ICL-NUIM", Some([525.0; 2]), Some(1000.0))
            }
            Self::Named => (LogFormat::DepthFolder, "no dataset", None, None),
        };
        Usual { format, words, focal_px, units_per_m }
    }
}

/// The depth images of a folder, in order.
#[derive(Debug, Clone)]
pub(crate) struct FoundImages {
    /// The folder that was named.
    pub(super) folder: PathBuf,
    pub(super) layout: Layout,
    pub(super) images: Vec<FoundImage>,
    /// The file that says which camera took them.
    pub(super) camera_file: Option<PathBuf>,
    pub(super) notes: Vec<String>,
}

/// An image that is named or there.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct FoundImage {
    pub(super) path: PathBuf,
    pub(super) stamp_ns: Option<i64>,
}

impl FoundImages {
    /// The images that a list in `path` names; `None` where there is no list, or none in it.
    pub(crate) fn listed(path: &Path) -> Result<Option<Self>, LogError> {
        let Some((list, mut listed)) = list::find(path)? else { return Ok(None) };
        if listed.is_empty() {
            return Ok(None);
        }
        let layout = if listed.iter().all(counts) { Layout::Icl } else { Layout::Tum };
        if layout == Layout::Icl {
            listed.sort_by_key(|image| image.stamp_ns);
        }
        let image =
            |listed: Listed| FoundImage { path: path.join(listed.path), stamp_ns: Some(listed.stamp_ns) };
        let notes =
            vec![format!("images and stamps from {}, read as {}", shown_path(&list), layout.usual().words)];
        let images = listed.into_iter().map(image).collect();
        Ok(Some(Self { folder: path.into(), layout, images, camera_file: camera_file(path, path)?, notes }))
    }

    /// The PNGs in `path`, its `depth/` or its only other folder with `depth` in its name; `None` where there are none.
    pub(crate) fn in_folder(path: &Path) -> Result<Option<Self>, LogError> {
        for place in [path.join("depth"), path.to_owned()] {
            if place.is_dir() && !pngs(&place)?.is_empty() {
                return Self::of_place(path, &place).map(Some);
            }
        }
        let mut places = depth_folders(path)?;
        match (places.pop(), places.pop()) {
            (None, _) => Ok(None),
            (Some(only), None) => Self::of_place(path, &only).map(Some),
            (Some(one), Some(other)) => {
                let [one, other] = [one, other].map(|place| place.display().to_string());
                let problem =
                    format!("several folders with depth images: {other}, {one}; name the one that is meant");
                Err(LogError::Option { path: path.into(), problem })
            }
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.images.len()
    }

    fn of_place(path: &Path, place: &Path) -> Result<Self, LogError> {
        let mut files = pngs(place)?;
        let order = names::put_in_order(&mut files);
        let layout = layout_of(&files);
        let stamps_ns = match layout {
            Layout::Tum => names::stamps_ns(&files).map(|(stamps_ns, _)| stamps_ns),
            Layout::Icl => files.iter().map(|file| Some(number(file)? * 1_000_000_000)).collect(),
            Layout::Numbered | Layout::Named => None,
        };
        let stamps = match layout {
            Layout::Tum => "stamps from the file names",
            Layout::Icl => "the numbers in the file names taken as stamps, seconds",
            Layout::Numbered | Layout::Named => "no stamps",
        };
        let mut notes = vec![order.replace("scans", "images")];
        notes.push(format!("images in {} read as {}: {stamps}", shown_path(place), layout.usual().words));
        let stamp = |k: usize| stamps_ns.as_ref().and_then(|stamps_ns| stamps_ns.get(k).copied());
        let image = |(k, path): (usize, PathBuf)| FoundImage { path, stamp_ns: stamp(k) };
        let images = files.into_iter().enumerate().map(image).collect();
        let camera_file = camera_file(path, place)?;
        Ok(Self { folder: path.into(), layout, images, camera_file, notes })
    }
}

/// Whether an image of a list has a small whole number for a name and for a stamp: ICL-NUIM. TUM RGB-D has both with
/// six decimals.
fn counts(image: &Listed) -> bool {
    number(&image.path).is_some() && image.stamp_ns % 1_000_000_000 == 0
}

/// The number that a file is named by, where it is a counter.
fn number(file: &Path) -> Option<i64> {
    let stem = file.file_stem()?.to_str()?;
    let digits = (1..=COUNTER_DIGITS).contains(&stem.len()) && stem.bytes().all(|c| c.is_ascii_digit());
    digits.then(|| stem.parse().ok()).flatten()
}

/// By the names alone: a leading zero separates Redwood's counters from those of ICL-NUIM.
fn layout_of(files: &[PathBuf]) -> Layout {
    if names::stamps_ns(files).is_some() {
        return Layout::Tum;
    }
    if !files.iter().all(|file| number(file).is_some()) {
        return Layout::Named;
    }
    let stem = |file: &PathBuf| file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let padded = |file: &PathBuf| stem(file).len() > 1 && stem(file).starts_with('0');
    if files.iter().any(padded) { Layout::Numbered } else { Layout::Icl }
}

/// The PNGs of a folder, those that are hidden left out.
fn pngs(folder: &Path) -> Result<Vec<PathBuf>, LogError> {
    let is_png = |file: &Path| {
        !is_hidden(file) && file.extension().is_some_and(|found| found.eq_ignore_ascii_case("png"))
    };
    files_where(folder, is_png)
}

/// Folders within a folder that have `depth` in their names and PNGs in them, by name.
fn depth_folders(path: &Path) -> Result<Vec<PathBuf>, LogError> {
    let mut found = Vec::new();
    for place in entries(path)? {
        let name = place.file_name().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        if name.contains("depth") && !name.starts_with('.') && is_folder(&place)? && !pngs(&place)?.is_empty()
        {
            found.push(place);
        }
    }
    found.sort();
    Ok(found)
}

/// `camera.json` in the folder that was named, or beside the images; where their own folder was named, above it.
fn camera_file(folder: &Path, place: &Path) -> Result<Option<PathBuf>, LogError> {
    let absolute = std::path::absolute(folder).ok();
    let is_depth = |folder: &Path| {
        let name = folder.file_name().unwrap_or_default().to_string_lossy();
        name.to_ascii_lowercase().contains("depth")
    };
    let above = absolute.as_deref().filter(|folder| is_depth(folder)).and_then(Path::parent);
    let places = [Some(folder), Some(place), above];
    first_file(places.into_iter().flatten().map(|place| place.join("camera.json")))
}
