//! The log on the command line, and how it is read.

use std::path::PathBuf;

use dmp::Config;
use dmp_draw::text::counted;
use dmp_log::{
    LogError, LogOptions, LogOutline, LogSummary, LogSurvey, PointTime, ScanLog, StampAt, StaticFrames,
    open_log, outline_log, read_trajectory, survey_log,
};

use crate::console::Usage;
use crate::options::input::TimesOfPoints;
use crate::options::{Asked, input};

/// A log and how it is read.
#[derive(Debug, Clone)]
pub(crate) struct LogInput {
    pub(crate) path: PathBuf,
    pub(crate) options: LogOptions,
}

/// What is known of a log, open or by its index.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LogHead<'a> {
    /// Returns are 0 where only an index was read.
    pub(crate) summary: &'a LogSummary,
    pub(crate) static_frames: &'a StaticFrames,
    pub(crate) scans: usize,
}

impl<'a> LogHead<'a> {
    pub(crate) fn of_log(log: &'a dyn ScanLog) -> Self {
        Self { summary: log.summary(), static_frames: log.static_frames(), scans: log.frames().len() }
    }

    pub(crate) fn of_outline(outline: &'a LogOutline) -> Self {
        let (summary, static_frames) = (outline.summary(), outline.static_frames());
        Self { summary, static_frames, scans: outline.scans().len() }
    }
}

impl LogInput {
    /// The log that is the first argument.
    pub(crate) fn of(asked: &Asked) -> Result<Self, Usage> {
        Ok(Self::at(asked.need(&input::LOG)?, asked))
    }

    pub(crate) fn at(path: PathBuf, asked: &Asked) -> Self {
        let TimesOfPoints { unit, field } = asked.get(&input::POINT_TIME).unwrap_or_default();
        let options = LogOptions {
            topic: asked.get(&input::TOPIC),
            point_time: unit,
            point_time_field: field,
            stamp_at: asked.get(&input::STAMP).unwrap_or_default(),
            bin_layout: asked.get(&input::BIN_LAYOUT),
            ..LogOptions::default()
        };
        Self { path, options }
    }

    /// The same log with the times of its points, where those are ignored.
    pub(crate) fn with_point_times(&self) -> Option<Self> {
        (self.options.point_time == PointTime::Ignore).then(|| {
            let options = LogOptions { point_time: PointTime::Auto, ..self.options.clone() };
            Self { options, ..self.clone() }
        })
    }

    /// The same log, each scan an instant: that of its stamp, whichever that is.
    pub(crate) fn without_point_times(&self) -> Self {
        let stamp_at = StampAt::default();
        let options = LogOptions { point_time: PointTime::Ignore, stamp_at, ..self.options.clone() };
        Self { options, ..self.clone() }
    }

    /// The same log for those who read every scan: it is checked while that is done.
    pub(crate) fn checked_as_read(&self) -> Self {
        let options = LogOptions { is_checked_as_read: true, ..self.options.clone() };
        Self { options, ..self.clone() }
    }

    /// Opens the log in so many threads, but no more than there are cores.
    pub(crate) fn open(&self, threads: usize) -> anyhow::Result<Box<dyn ScanLog>> {
        Ok(in_threads(threads, || open_log(&self.path, &self.options).map_err(swapped))??)
    }

    /// Reads the index of the log.
    pub(crate) fn outline(&self) -> Result<LogOutline, LogError> {
        outline_log(&self.path, &self.options).map_err(swapped)
    }

    /// Everything that the log holds, also where it cannot be opened without more options.
    pub(crate) fn survey(&self) -> anyhow::Result<LogSurvey> {
        Ok(in_threads(Config::default().threads, || survey_log(&self.path, &self.options))??)
    }
}

/// Opens a log in so many threads, but no more than there are cores: whether they are too many is checked later.
pub(crate) fn in_threads<R: Send>(threads: usize, open: impl FnOnce() -> R + Send) -> anyhow::Result<R> {
    Ok(dmp::in_threads(threads.clamp(1, Config::default().threads), open)?)
}

/// Reports a trajectory passed where a log was expected.
fn swapped(error: LogError) -> LogError {
    let LogError::UnknownFormat { path, looked_for } = error else { return error };
    let looked_for = match read_trajectory(&path) {
        Ok(file) => format!(
            "it is a trajectory ({}, {}): the log comes first, and trajectories behind -t",
            file.format.name(),
            counted(file.trajectory.len() as u64, "pose")
        ),
        Err(_) => looked_for,
    };
    LogError::UnknownFormat { path, looked_for }
}
