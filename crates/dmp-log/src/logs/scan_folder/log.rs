//! The files of a folder as a log.

use super::entry::Entry;
use super::times::read_times;
use crate::file::ReadCount;
use crate::logs::scan_folder::scan_file::{ScanFile, ScanFormat};
use crate::points::{Layout, Rows, TimeChoice};
use crate::scans::of_frame;
use crate::{FrameInfo, LogError, LogIndex, LogOptions, LogSummary, ScanLog, ScanReader};
use dmp_sensor::Scan;
use std::path::PathBuf;

/// A folder of scans, one file each.
#[derive(Debug)]
pub(crate) struct ScanFolder {
    pub(super) format: ScanFormat,
    /// Of files without a header.
    pub(super) bin: Option<Layout>,
    pub(super) entries: Vec<Entry>,
    pub(super) layouts: Vec<Layout>,
    pub(super) frames: Vec<FrameInfo>,
    pub(super) time: Option<TimeChoice>,
    /// The folder with the times of the points, where they are not in a field.
    pub(super) times: Option<PathBuf>,
    pub(super) summary: LogSummary,
    pub(super) options: LogOptions,
    pub(super) count: ReadCount,
}

impl ScanFolder {
    /// Bytes of the file of each frame.
    pub(crate) fn scan_bytes(&self) -> Vec<u64> {
        self.entries.iter().map(|entry| entry.file.length).collect()
    }

    /// The field with the times of points, where they are in the scans themselves.
    pub(super) fn time_field(&self) -> Option<&str> {
        self.time.as_ref().filter(|_| self.times.is_none()).map(|choice| choice.field.as_str())
    }

    /// That of the first scan with points; without any, that of the first scan.
    pub(super) fn first_layout(&self) -> Option<&Layout> {
        let first = self.entries.iter().find(|entry| entry.points > 0).or(self.entries.first());
        self.layouts.get(first?.layout)
    }

    /// Reads the points of a file into `data`.
    pub(super) fn rows_of<'a>(&'a self, entry: &Entry, data: &'a mut Vec<u8>) -> Result<Rows<'a>, LogError> {
        let mut file = ScanFile::open(&entry.file.path, (self.format, self.bin.as_ref()), &self.count)?;
        let known = file.known.clone();
        let changed = || known.changed_since(&entry.file);
        let layout = self.layouts.get(entry.layout).ok_or_else(changed)?;
        if known != entry.file || file.head.layout != *layout {
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

    fn index(&self) -> Result<Option<LogIndex>, LogError> {
        Ok(Some(LogIndex::whole(&self.summary, &self.options)))
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
        let entry = of_frame(&log.entries, frame, &log.summary.path)?;
        scan.stamp_ns = entry.stamp_ns;
        let rows = log.rows_of(entry, &mut self.data)?;
        let in_rows = log.time.as_ref().filter(|_| log.times.is_none());
        rows.append_to(
            in_rows.and_then(|time| Some((rows.layout.time_field(&time.field)?, time.rule))),
            scan,
        );
        match (&log.times, &log.time) {
            (Some(folder), Some(time)) => {
                read_times(folder, time.rule, entry, &log.count, &mut self.data, scan)
            }
            _ => Ok(()),
        }
    }
}
