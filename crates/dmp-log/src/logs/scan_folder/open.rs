//! Opening a folder: which of its files can be read, and the summary of them.

use super::bin;
use super::entry::Entry;
use super::found::FoundScans;
use super::log::ScanFolder;
use super::stamps;
use crate::file::{DamageList, KnownFile, ReadCount, fingerprint, first_in_words, pool};
use crate::logs::scan_folder::scan_file::{Cut, ScanFile, ScanFormat};
use crate::points::Layout;
use crate::{Damage, FrameInfo, LogError, LogOptions, LogSetting, LogSummary, PlaceInFile, shown_path};
use dmp_lengths::thousands;
use std::path::{Path, PathBuf};

/// What opening finds in a file.
struct LookedAt {
    file: KnownFile,
    layout: Layout,
    /// How many are there.
    points: u64,
    cut: Option<Cut>,
}

impl LookedAt {
    fn of(
        path: &Path,
        format: (ScanFormat, Option<&Layout>),
        count: &ReadCount,
        unpack: bool,
    ) -> Result<Self, LogError> {
        let mut file = ScanFile::open(path, format, count)?;
        let (points, cut) = file.whole_points(unpack)?;
        Ok(Self { file: file.known, layout: file.head.layout, points, cut })
    }
}

impl ScanFolder {
    /// Reads the heads of the files; of those in text, every line; what is compressed is unpacked once. Looks at several files
    /// at a time where this is called in a pool with several threads.
    pub(crate) fn open(found: FoundScans, options: &LogOptions) -> Result<Self, LogError> {
        Self::open_with(found, options, true)
    }

    /// The same with nothing unpacked: what cannot be is an error when it is read.
    pub(crate) fn outline(found: FoundScans, options: &LogOptions) -> Result<Self, LogError> {
        Self::open_with(found, options, false)
    }

    fn open_with(found: FoundScans, options: &LogOptions, unpack: bool) -> Result<Self, LogError> {
        let FoundScans { folder, format, files, mut notes } = found;
        if let Some(topic) = &options.topic {
            let problem = "was given, but a folder of scans has no topics";
            return Err(LogError::setting(&folder, LogSetting::Topic, topic, problem));
        }
        let stamps_ns = stamps::find(&folder, &files, &mut notes)?;
        let count = ReadCount::default();
        let bin = match (format, &options.bin_layout) {
            (ScanFormat::Bin, said) => {
                let (layout, note) = bin::layout_of(&folder, &files, said.as_ref(), &count)?;
                notes.extend(note);
                Some(layout)
            }
            (_, Some(said)) => {
                let problem = "was given, but the scans are not .bin";
                return Err(LogError::setting(&folder, LogSetting::BinLayout, said, problem));
            }
            (_, None) => None,
        };
        let summary = LogSummary { notes, ..LogSummary::of(&folder, format.of_log()) };
        let (entries, layouts, frames) = (Vec::new(), Vec::new(), Vec::new());
        let mut log = Self {
            format,
            bin,
            entries,
            layouts,
            frames,
            time: None,
            times: None,
            summary,
            options: options.clone(),
            count,
        };
        log.take_stock(&files, stamps_ns.as_deref(), unpack)?;
        log.describe();
        log.decide_time(options)?;
        log.describe();
        if log.entries.is_empty() {
            let problem = format!("no scan can be read{}", first_in_words(&log.summary.damage));
            return Err(LogError::malformed(&log.summary.path, PlaceInFile::WholeFile, problem));
        }
        Ok(log)
    }

    fn take_stock(
        &mut self,
        files: &[PathBuf],
        stamps_ns: Option<&[i64]>,
        unpack: bool,
    ) -> Result<(), LogError> {
        let (mut names, mut damage, mut in_world) = (Vec::new(), DamageList::default(), None);
        let (format, bin, count) = (self.format, self.bin.clone(), self.count.clone());
        let look = |path: &PathBuf| {
            let length = std::fs::metadata(path).map_err(|e| LogError::io(path, "open", e))?.len();
            Ok((length, LookedAt::of(path, (format, bin.as_ref()), &count, unpack)))
        };
        for (number, (path, looked_at)) in files.iter().zip(pool::in_order(files, look)).enumerate() {
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let (length, looked_at) = looked_at?;
            self.summary.bytes += length;
            names.push((name, length));
            let LookedAt { file, layout, points, cut } = match looked_at {
                Ok(looked_at) => looked_at,
                Err(LogError::Malformed { path, place, problem }) => {
                    let place = format!("{}, {place}", shown_path(&path));
                    let what = format!("{problem}; the scan is skipped");
                    damage.push(Damage::new(place, what));
                    continue;
                }
                Err(LogError::WorldCoordinates { path, problem }) => {
                    let what = format!(
                        "{problem}: points in world coordinates are a map (--map), or with --made-with a log, as one file; \
                         the scan is skipped"
                    );
                    damage.push(Damage::new(format!("{}, the whole file", shown_path(&path)), what));
                    in_world.get_or_insert(LogError::WorldCoordinates { path, problem });
                    continue;
                }
                Err(error) => return Err(error),
            };
            let is_cut = cut.is_some();
            if let Some(cut) = cut {
                let place = format!("{}, {}", shown_path(path), cut.place);
                damage.push(Damage::new(place, cut.what));
            }
            // The last layout is almost always the one.
            let known = self.layouts.iter().rposition(|known| *known == layout);
            if known.is_none() {
                self.layouts.push(layout);
            }
            let layout = known.unwrap_or(self.layouts.len() - 1);
            let stamp_ns = stamps_ns.and_then(|stamps| stamps.get(number).copied());
            self.entries.push(Entry { file, points, layout, stamp_ns, is_cut });
        }
        self.summary.damage = damage.into_vec();
        if let Some(error) = in_world.filter(|_| self.entries.is_empty()) {
            return Err(error);
        }
        self.check_bin()?;
        let names = names.iter().map(|(name, length)| (name.as_str(), *length));
        self.summary.fingerprint = fingerprint::of_names(names);
        Ok(())
    }

    /// Files without a header may be of another layout; one that ends within a point may be cut, most do not.
    fn check_bin(&self) -> Result<(), LogError> {
        let cut = self.entries.iter().filter(|entry| entry.is_cut).count();
        if self.format != ScanFormat::Bin || cut < 2 || 2 * cut <= self.entries.len() {
            return Ok(());
        }
        let problem = format!(
            "{} of {} files are no whole number of points of {} bytes ({}): they have another layout (--bin-layout)",
            thousands(cut),
            thousands(self.entries.len()),
            self.bin.as_ref().map_or(0, Layout::point_bytes),
            self.bin.as_ref().map_or_else(String::new, |layout| layout.names().join(", "))
        );
        Err(LogError::malformed(&self.summary.path, PlaceInFile::WholeFile, problem))
    }

    /// Fills what follows from the entries.
    fn describe(&mut self) {
        let info = |entry: &Entry| FrameInfo { stamp_ns: entry.stamp_ns, returns: entry.points };
        self.frames = self.entries.iter().map(info).collect();
        self.summary.describe(&self.frames);
        if let Some(layout) = self.first_layout() {
            (self.summary.fields, self.summary.point_bytes) =
                (layout.field_infos(self.time_field()), layout.point_bytes());
        }
    }
}
