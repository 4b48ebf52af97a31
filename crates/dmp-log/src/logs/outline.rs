//! The scans of a log as its index lists them, and parts of it.

use super::bag_log::BagOutline;
use super::depth_folder::DepthFolder;
use super::find::{Found, find_for};
use super::las_log::LasLog;
use super::scan_folder::ScanFolder;
use crate::scans::PartLog;
use crate::{
    Damage, FrameInfo, LogError, LogOptions, LogSummary, MemoryLog, OutlinedScan, ScanLog, StaticFrames,
};
use dmp_lengths::thousands;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The scans of a log as its index lists them: hardly any of them is read.
///
/// A scan's number is its place in the log's own order, from 0; what a log's index names has a number, also
/// where it turns out to be damaged when it is read.
#[derive(Debug)]
pub struct LogOutline {
    path: PathBuf,
    scans: Vec<OutlinedScan>,
    source: Source,
}

/// What parts are opened from.
#[derive(Debug)]
enum Source {
    Bag(Box<BagOutline>),
    /// A log that is cheap to open, or has no index: it is open.
    Whole {
        log: Arc<dyn ScanLog>,
        notes: Vec<String>,
    },
}

/// Tells the scans of the log at `path` from its index: those of an MCAP file from the message indexes behind
/// its chunks, those of a rosbag2 `.db3` from its table, those of a folder from its files.
///
/// A few scans are looked at (about ten, evenly spread) for what holds for all: how far their stamps are from the
/// times that the index has, what the times of points mean, the time from scan to scan. What has no index is
/// read: chunks without one, files of text in a folder, one LAS or LAZ file in world coordinates;
/// [`LogOutline::notes`] says so.
///
/// # Errors
/// As [`open_log`](crate::open_log).
///
/// ```
/// use dmp_log::{LogOptions, McapScanWriter, McapWriterOptions, outline_log};
/// use dmp_sensor::Scan;
///
/// # let folder = tempfile::tempdir()?;
/// # let path = folder.path().join("town.mcap");
/// let mut writer = McapScanWriter::create(&path, &McapWriterOptions::default())?;
/// for k in 0..100 {
///     let points_in_sensor_m = vec![[4.0, 3.0, 0.5]; 10];
///     writer.write_scan(&Scan { stamp_ns: Some(k * 100_000_000), points_in_sensor_m, time_offsets_ns: vec![] })?;
/// }
/// writer.finish()?;
///
/// let outline = outline_log(&path, &LogOptions::default())?;
/// assert_eq!(outline.scans().len(), 100);
/// let part = outline.open(&[7, 8, 90])?;
/// assert_eq!((part.frames().len(), part.number_in_log(2), part.scans_in_log()), (3, 90, 100));
/// assert_eq!(part.frames()[2].stamp_ns, Some(9_000_000_000));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn outline_log(path: &Path, options: &LogOptions) -> Result<LogOutline, LogError> {
    let (scans, source) = match find_for(path, options)? {
        Found::Bag(bag) => {
            let outline = BagOutline::open(bag, options)?;
            (outline.scans(), Source::Bag(Box::new(outline)))
        }
        Found::Folder(scans) => {
            let folder = ScanFolder::outline(scans, options)?;
            let bytes = folder.scan_bytes();
            Source::whole(folder, &bytes)
        }
        Found::Depth(images) => {
            let log = DepthFolder::open(images, options)?;
            let bytes = log.scan_bytes();
            Source::whole(log, &bytes)
        }
        Found::Las => {
            let log = LasLog::open(path, options)?;
            let bytes = log.scan_bytes();
            Source::whole(log, &bytes)
        }
    };
    Ok(LogOutline { path: path.into(), scans, source })
}

impl Source {
    /// A log of which every scan is known: each is read by itself.
    fn whole(log: impl ScanLog + 'static, bytes: &[u64]) -> (Vec<OutlinedScan>, Self) {
        let scan = |(number, (frame, &bytes)): (usize, (&FrameInfo, &u64))| OutlinedScan {
            stamp_ns: frame.stamp_ns,
            group: number as u32,
            bytes,
        };
        let scans = log.frames().iter().zip(bytes).enumerate().map(scan).collect();
        let (read, all) = (log.bytes_read().unwrap_or(0), log.summary().bytes);
        let mut notes = Vec::new();
        if read > all / 2 {
            notes.push(format!(
                "the {} has no index of its scans: {} of {} bytes were read to find them",
                log.summary().format.name(),
                thousands(read),
                thousands(all)
            ));
        }
        (scans, Self::Whole { log: Arc::new(log), notes })
    }
}

impl LogOutline {
    /// Every scan of the log, in its own order.
    pub fn scans(&self) -> &[OutlinedScan] {
        &self.scans
    }

    /// The summary of the log. Returns are not known, 0, where only an index was read, and stamps as near as that
    /// has them.
    pub fn summary(&self) -> &LogSummary {
        match &self.source {
            Source::Bag(bag) => &bag.summary,
            Source::Whole { log, .. } => log.summary(),
        }
    }

    /// Where sensors and bodies sit on one another, where the log says it; of a bag that repeats it all the time,
    /// what its first messages say.
    pub fn static_frames(&self) -> &StaticFrames {
        match &self.source {
            Source::Bag(bag) => &bag.static_frames,
            Source::Whole { log, .. } => log.static_frames(),
        }
    }

    /// Bytes of the whole log.
    pub fn bytes(&self) -> u64 {
        self.summary().bytes
    }

    /// Bytes read so far for the outline, its parts and their readers: as [`ScanLog::bytes_read`].
    pub fn bytes_read(&self) -> Option<u64> {
        match &self.source {
            Source::Bag(bag) => bag.bytes_read(),
            Source::Whole { log, .. } => log.bytes_read(),
        }
    }

    /// How far the stamp of a scan that was looked at is at most from that of the index, nanoseconds; 0 where
    /// the index has the stamps themselves. Others may be farther off. Of the order of the log's length where
    /// the times in the index mean nothing.
    pub fn stamp_error_ns(&self) -> i64 {
        match &self.source {
            Source::Bag(bag) => bag.stamp_error_ns,
            Source::Whole { .. } => 0,
        }
    }

    /// The usual time from scan to scan in the whole log, nanoseconds: what parts have as
    /// [`period_ns`](crate::LogSummary::period_ns).
    pub fn period_ns(&self) -> Option<i64> {
        self.summary().period_ns
    }

    /// What was guessed or left aside, and what had to be read for lack of an index.
    pub fn notes(&self) -> Vec<String> {
        let more: &[String] = match &self.source {
            Source::Bag(_) => &[],
            Source::Whole { notes, .. } => notes,
        };
        [self.summary().notes.as_slice(), more].concat()
    }

    /// What is known to be lost. Damage within scans that were not read is not known.
    pub fn damage(&self) -> &[Damage] {
        &self.summary().damage
    }

    /// Opens the scans with these numbers, ascending, as the outline was made: by the same topic, and with the
    /// meaning of times that the whole log has. What these scans are packed in is read and checked as by
    /// [`open_log`](crate::open_log), and in a bag the chunks with `/tf_static`; nothing else is.
    ///
    /// A scan that is damaged is skipped and named in the part's [`damage`](crate::LogSummary::damage);
    /// [`ScanLog::number_in_log`] says which are there.
    ///
    /// # Errors
    /// When numbers are not ascending or beyond the log, when the log has changed since, and when none of the
    /// scans can be read.
    pub fn open(&self, wanted: &[usize]) -> Result<Box<dyn ScanLog>, LogError> {
        self.check(wanted)?;
        match &self.source {
            Source::Bag(bag) => Ok(Box::new(bag.part(wanted)?)),
            Source::Whole { log, notes } => Ok(Box::new(PartLog::of(Arc::clone(log), wanted, notes))),
        }
    }

    /// The same, with the scans held in memory: what they are packed in is read once. None may be left.
    ///
    /// # Errors
    /// As [`Self::open`], but for scans that cannot be read.
    pub fn load(&self, wanted: &[usize]) -> Result<MemoryLog, LogError> {
        self.check(wanted)?;
        match &self.source {
            Source::Bag(bag) => bag.load(wanted),
            Source::Whole { log, notes } => MemoryLog::of(&PartLog::of(Arc::clone(log), wanted, notes)),
        }
    }

    /// Whether these are numbers of scans, ascending.
    fn check(&self, wanted: &[usize]) -> Result<(), LogError> {
        let option = |problem: String| Err(LogError::Option { path: self.path.clone(), problem });
        let steps = wanted.iter().zip(wanted.iter().skip(1));
        if let Some((before, number)) = steps.into_iter().find(|(before, number)| number <= before) {
            return option(format!("scan {number} was asked for behind scan {before}"));
        }
        match wanted.last() {
            None => option("no scan was asked for".to_owned()),
            Some(&last) if last >= self.scans.len() => {
                option(format!("scan {last} was asked for, the log has {}", self.scans.len()))
            }
            Some(_) => Ok(()),
        }
    }
}
