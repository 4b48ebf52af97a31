//! Scan logs as a folder of files with one scan each.

mod calendar;
mod decide;
mod format;
mod found;
mod head;
mod las;
pub(crate) mod names;
mod pcd;
mod ply;
mod stamps;
mod text;
mod times;

use crate::damage::DamageList;
use crate::log::{period_ns, runs_of_eight, span_ns};
use crate::points::{Layout, Rows, TimeChoice};
use crate::reads::ReadCount;
use crate::{Damage, FrameInfo, LogError, LogOptions, LogSummary, Place, ScanLog, ScanReader, fingerprint};
use dmp_sensor::Scan;
use format::ScanFormat;
pub(crate) use found::FoundScans;
use head::ScanFile;
pub(crate) use stamps::parse_times;
use std::ops::Range;
use std::path::PathBuf;
use std::time::SystemTime;
use times::{Beside, read_times};

/// A folder of scans, one file each.
#[derive(Debug)]
pub(crate) struct ScanFolder {
    format: ScanFormat,
    entries: Vec<Entry>,
    layouts: Vec<Layout>,
    frames: Vec<FrameInfo>,
    time: Option<Times>,
    summary: LogSummary,
    count: ReadCount,
}

/// A file that can be read.
#[derive(Debug)]
struct Entry {
    path: PathBuf,
    points: u64,
    /// Its place among the layouts.
    layout: usize,
    stamp_ns: Option<i64>,
    /// Length and time of the last change: whatever differs later is another file.
    length: u64,
    modified: Option<SystemTime>,
    /// Fewer points than there should be.
    is_cut: bool,
}

/// Where the times of the points are.
#[derive(Debug)]
enum Times {
    Field(TimeChoice),
    Beside(Beside),
}

impl ScanFolder {
    /// Reads the heads of the files; of those in text, every line.
    pub(crate) fn open(found: FoundScans, options: &LogOptions) -> Result<Self, LogError> {
        let FoundScans { folder, format, files, mut notes } = found;
        if let Some(topic) = &options.topic {
            let problem = format!("--topic {topic} was given, but a folder of scans has no topics");
            return Err(LogError::Option { path: folder, problem });
        }
        let stamps_ns = stamps::find(&folder, &files, &mut notes)?;
        let summary = LogSummary {
            path: folder,
            format: format.of_log(),
            topic: None,
            frame_id: None,
            fields: Vec::new(),
            point_bytes: 0,
            returns: 0,
            span_ns: None,
            period_ns: None,
            point_times: None,
            middle_ns: 0,
            camera: None,
            depth_units_per_m: None,
            notes,
            damage: Vec::new(),
            fingerprint: String::new(),
            bytes: 0,
            topics: Vec::new(),
        };
        let (entries, layouts, frames) = (Vec::new(), Vec::new(), Vec::new());
        let mut log =
            Self { format, entries, layouts, frames, time: None, summary, count: ReadCount::default() };
        log.take_stock(&files, stamps_ns.as_deref())?;
        log.describe();
        log.decide_time(options)?;
        log.describe();
        if log.entries.is_empty() {
            let first = log.summary.damage.first();
            let lost = first.map(|first| format!("; {}: {}", first.place, first.what)).unwrap_or_default();
            let problem = format!("no scan can be read{lost}");
            return Err(LogError::malformed(&log.summary.path, Place::WholeFile, problem));
        }
        Ok(log)
    }

    fn take_stock(&mut self, files: &[PathBuf], stamps_ns: Option<&[i64]>) -> Result<(), LogError> {
        let (mut names, mut damage) = (Vec::new(), DamageList::default());
        for (number, path) in files.iter().enumerate() {
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let length = std::fs::metadata(path).map_err(|e| LogError::io(path, "open", e))?.len();
            self.summary.bytes += length;
            names.push((name, length));
            let mut file = match ScanFile::open(path, self.format, &self.count) {
                Ok(file) => file,
                Err(LogError::Malformed { path, place, problem }) => {
                    let place = format!("{}, {place}", path.display());
                    let what = format!("{problem}; the scan is skipped");
                    damage.push(Damage::new(place, what));
                    continue;
                }
                Err(error) => return Err(error),
            };
            let (points, cut) = file.whole_points()?;
            let is_cut = cut.is_some();
            if let Some(cut) = cut {
                let place = format!("{}, {}", path.display(), cut.place);
                damage.push(Damage::new(place, cut.what));
            }
            // The last layout is almost always the one.
            let known = self.layouts.iter().rposition(|known| *known == file.head.layout);
            let layout = known.unwrap_or(self.layouts.len());
            if known.is_none() {
                self.layouts.push(file.head.layout);
            }
            let stamp_ns = stamps_ns.and_then(|stamps| stamps.get(number).copied());
            let ScanFile { length, modified, .. } = file;
            let path = path.clone();
            self.entries.push(Entry { path, points, layout, stamp_ns, length, modified, is_cut });
        }
        self.summary.damage = damage.into_vec();
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
            "{cut} of {} files are no whole number of points of 16 bytes (float32 x, y, z, intensity): they have \
             another layout",
            self.entries.len()
        );
        Err(LogError::malformed(&self.summary.path, Place::WholeFile, problem))
    }

    /// Fills what follows from the entries.
    fn describe(&mut self) {
        let info = |entry: &Entry| FrameInfo { stamp_ns: entry.stamp_ns, returns: entry.points };
        self.frames = self.entries.iter().map(info).collect();
        self.summary.returns = self.frames.iter().map(|frame| frame.returns).sum();
        self.summary.span_ns = span_ns(&self.frames);
        self.summary.period_ns = period_ns(&self.frames);
        if let Some(layout) = self.first_layout() {
            (self.summary.fields, self.summary.point_bytes) =
                (layout.field_infos(self.time_field()), layout.point_bytes());
        }
    }

    /// Bytes of the file of each frame.
    pub(crate) fn scan_bytes(&self) -> Vec<u64> {
        self.entries.iter().map(|entry| entry.length).collect()
    }

    /// The field with the times of points, where they are in the scans themselves.
    fn time_field(&self) -> Option<&str> {
        match &self.time {
            Some(Times::Field(choice)) => Some(&choice.field),
            _ => None,
        }
    }

    /// That of the first scan with points; without any, that of the first scan.
    fn first_layout(&self) -> Option<&Layout> {
        let first = self.entries.iter().find(|entry| entry.points > 0).or(self.entries.first());
        self.layouts.get(first?.layout)
    }

    /// Reads the points of a file into `data`.
    fn rows_of<'a>(&'a self, entry: &Entry, data: &'a mut Vec<u8>) -> Result<Rows<'a>, LogError> {
        let mut file = ScanFile::open(&entry.path, self.format, &self.count)?;
        let (before, now) = (entry.length, file.length);
        let changed = || {
            let problem = format!("the file has changed since it was opened: {before} bytes then, {now} now");
            LogError::malformed(&entry.path, Place::WholeFile, problem)
        };
        let layout = self.layouts.get(entry.layout).ok_or_else(changed)?;
        if (file.length, file.modified) != (entry.length, entry.modified) || file.head.layout != *layout {
            return Err(changed());
        }
        file.read_rows(entry.points, data)?;
        if data.len() as u64 != entry.points.saturating_mul(layout.point_bytes().into()) {
            return Err(changed());
        }
        Ok(Rows::one(layout, data, entry.points as usize))
    }
}

impl ScanLog for ScanFolder {
    fn summary(&self) -> &LogSummary {
        &self.summary
    }

    fn frames(&self) -> &[FrameInfo] {
        &self.frames
    }

    fn reader(&self) -> Result<Box<dyn ScanReader + '_>, LogError> {
        Ok(Box::new(FolderReader { log: self, data: Vec::new() }))
    }

    fn groups(&self) -> Vec<Range<usize>> {
        runs_of_eight(self.entries.len())
    }

    fn bytes_read(&self) -> Option<u64> {
        Some(self.count.bytes())
    }
}

/// Reads scans of a [`ScanFolder`].
#[derive(Debug)]
struct FolderReader<'a> {
    log: &'a ScanFolder,
    data: Vec<u8>,
}

impl ScanReader for FolderReader<'_> {
    fn read(&mut self, frame: usize, scan: &mut Scan) -> Result<(), LogError> {
        scan.clear();
        let log = self.log;
        let Some(entry) = log.entries.get(frame) else {
            let problem = format!("the log has {} scans", log.entries.len());
            return Err(LogError::malformed(&log.summary.path, Place::Frame(frame as u64), problem));
        };
        scan.stamp_ns = entry.stamp_ns;
        let rows = log.rows_of(entry, &mut self.data)?;
        let field = match &log.time {
            Some(Times::Field(choice)) => rows.layout.field(&choice.field).map(|field| (field, choice.rule)),
            _ => None,
        };
        rows.append_to(field, scan);
        match &log.time {
            Some(Times::Beside(beside)) => read_times(beside, entry, &log.count, &mut self.data, scan),
            _ => Ok(()),
        }
    }
}
