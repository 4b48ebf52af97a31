//! Opening a log of any format.

use super::bag_log::BagLog;
use super::depth_folder::DepthFolder;
use super::find::{Found, find_for};
use super::las_log::LasLog;
use super::log_index::{IndexedScans, LogIndex};
use super::scan_folder::ScanFolder;
use crate::{LogError, LogOptions, LogSurvey, PlaceInFile, ScanLog, ScanStream};
use dmp_lengths::thousands;
use std::path::Path;

/// Opens the log at `path`: an MCAP file, rosbag2's files or folders, or a folder with one scan a file, as
/// `.bin`, `.pcd`, `.ply`, `.las` or `.laz`, a folder of depth images (TUM RGB-D, ICL-NUIM, Redwood), or one LAS or LAZ
/// file in world coordinates with what it was [made with](LogOptions::made_with).
///
/// Opening reads a bag once from start to end and takes stock of what is damaged, or [as it is
/// read](LogOptions::is_checked_as_read); of a folder of scans it reads
/// the heads of the files, and the lines of those in text, and unpacks what is compressed; of depth images their heads; of a LAS file all points, once.
///
/// What has to be decoded for that is decoded on all threads of the rayon pool that this is called in; without one, and for bags of
/// `SQLite`, on this one alone. What is found is the same.
///
/// # Errors
/// When there is nothing at the path, when it is in no format known here, when the choice of a topic or
/// the meaning of the times is left open, and when there is no scan in it. Damage to a part is no error,
/// see [`crate::LogSummary::damage`].
///
/// ```no_run
/// use dmp_log::{LogOptions, open_log};
///
/// let options = LogOptions { topic: Some("/front/points".into()), ..LogOptions::default() };
/// let log = open_log("drive.mcap".as_ref(), &options)?;
/// println!("{} scans, {} returns", log.frames().len(), log.summary().returns);
/// # Ok::<(), dmp_log::LogError>(())
/// ```
pub fn open_log(path: &Path, options: &LogOptions) -> Result<Box<dyn ScanLog>, LogError> {
    let found = find_for(path, options)?;
    Ok(match found {
        Found::Las => Box::new(LasLog::open(path, options)?),
        Found::Bag(bag) => Box::new(BagLog::open(bag, options)?),
        Found::Folder(scans) => Box::new(ScanFolder::open(scans, options)?),
        Found::Depth(images) => Box::new(DepthFolder::open(images, options)?),
    })
}

/// Tells what the log at `path` holds, also where [`open_log`] would ask for a topic or for the meaning of
/// the times.
///
/// # Errors
/// When there is nothing at the path, it cannot be read, is in no format known here, or has no such topic.
pub fn survey_log(path: &Path, options: &LogOptions) -> Result<LogSurvey, LogError> {
    let found = find_for(path, options)?;
    match found {
        Found::Las => Ok(survey_of(Box::new(LasLog::open(path, options)?), None)),
        Found::Bag(bag) => BagLog::survey(&bag, options),
        Found::Depth(images) => Ok(survey_of(Box::new(DepthFolder::open(images, options)?), None)),
        Found::Folder(scans) => {
            let (folder, problem) = match ScanFolder::open(scans.clone(), options) {
                Ok(folder) => (folder, None),
                Err(problem) => (ScanFolder::open(scans, &LogOptions::without_times())?, Some(problem)),
            };
            Ok(survey_of(Box::new(folder), problem))
        }
    }
}

/// A log without topics.
fn survey_of(log: Box<dyn ScanLog>, problem: Option<LogError>) -> LogSurvey {
    let summary = log.summary().clone();
    LogSurvey {
        path: summary.path,
        format: summary.format,
        bytes: summary.bytes,
        fingerprint: summary.fingerprint,
        topics: Vec::new(),
        static_frames: log.static_frames().clone(),
        damage: summary.damage,
        streams: vec![ScanStream { topic: None, log: Some(log), damage: Vec::new(), problem }],
    }
}

impl LogIndex {
    /// Opens the log at `path`, which may be elsewhere now. Its summary is what was found in it when it was indexed.
    ///
    /// # Errors
    /// When it is not there, or is another one: of another length or with other ends. That single scans are not what they were
    /// shows when they are read.
    pub fn open(&self, path: &Path) -> Result<Box<dyn ScanLog>, LogError> {
        match &self.scans {
            IndexedScans::Bag(scans) => Ok(Box::new(BagLog::of_scans(scans, path, &self.summary)?)),
            IndexedScans::Whole(options) => {
                let log = open_log(path, options)?;
                let (now, then) = (log.summary(), &self.summary);
                if (&now.fingerprint, now.returns) != (&then.fingerprint, then.returns) {
                    let problem = format!(
                        "it is {} with {} returns, and the log that was indexed is {} with {}",
                        now.fingerprint,
                        thousands(now.returns),
                        then.fingerprint,
                        thousands(then.returns)
                    );
                    return Err(LogError::malformed(path, PlaceInFile::WholeFile, problem));
                }
                Ok(log)
            }
        }
    }

    /// The log without its files, for what follows from its scans alone: when they were, how many returns they have. None can be
    /// read. `None` where only the log itself has it.
    ///
    /// # Errors
    /// When the index is none.
    pub fn unopened(&self) -> Result<Option<Box<dyn ScanLog>>, LogError> {
        let IndexedScans::Bag(scans) = &self.scans else { return Ok(None) };
        Ok(Some(Box::new(BagLog::unopened(scans, &self.summary)?)))
    }
}
