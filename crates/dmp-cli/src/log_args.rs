//! The log on the command line, and how it is to be read.

use dmp::Config;
use dmp_draw::text::counted;
use std::path::{Path, PathBuf};

use clap::Args;
use dmp_log::{
    LogError, LogOptions, LogOutline, LogSummary, LogSurvey, MadeWith, PointTime, ScanLog,
    StampAt, StaticFrames, open_log, outline_log, read_trajectory, survey_log,
};
use dmp_sensor::Isometry3;

use crate::parse;

/// The log and how it is to be read.
#[derive(Debug, Clone, Args)]
pub(crate) struct LogArgs {
    /// The log: FILE.mcap or a rosbag2 folder or .db3 with PointCloud2 or Livox CustomMsg, a folder of scans
    /// (.bin, .pcd, .ply, .las, .laz), a folder of depth images (TUM RGB-D, ICL-NUIM, Redwood: 16-bit PNG), or one
    /// .las or .laz file in world coordinates with --made-with
    #[arg(value_name = "LOG")]
    log: PathBuf,
    #[command(flatten)]
    reading: ReadingArgs,
}

/// How a log is to be read.
#[derive(Debug, Clone, Args)]
pub(crate) struct ReadingArgs {
    /// The topic with the scans, where the log has several
    #[arg(long, value_name = "NAME", help_heading = "Input")]
    topic: Option<String>,
    /// Times of points: `s`, `ms`, `us` or `ns` after the scan's stamp; `absolute-s` … on the clock of the
    /// stamps; `first-s` … on a clock of their own, after the scan's first point; `ignore`; or `auto`: found
    /// from the values
    #[arg(
        long,
        value_name = "UNIT",
        default_value = "auto",
        hide_default_value = true,
        help_heading = "Input"
    )]
    point_time: PointTime,
    /// Which instant of a scan its stamp is: its first point (`start`), the middle (`mid`) or its last point
    /// (`end`). It matters where times of points count from the scan's beginning
    #[arg(long, value_name = "AT", default_value = "start", help_heading = "Place and time")]
    stamp: StampAt,
    /// For a LAS or LAZ file in world coordinates: the trajectory it was made with. It brings the points back
    /// into the sensor's frame, by --extrinsic and --time-offset
    #[arg(long, value_name = "TRAJECTORY", help_heading = "Input")]
    made_with: Option<PathBuf>,
    /// Length of the scans that such a file is cut into, seconds
    #[arg(long, value_name = "SECONDS", default_value = "0.1", value_parser = parse::interval_ns)]
    #[arg(requires = "made_with", help_heading = "Input")]
    scan_period: i64,
}

/// What is told of a log, open or by its index.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LogHead<'a> {
    summary: &'a LogSummary,
    static_frames: &'a StaticFrames,
    scans: usize,
}

impl<'a> LogHead<'a> {
    pub(crate) fn of_log(log: &'a dyn ScanLog) -> Self {
        Self { summary: log.summary(), static_frames: log.static_frames(), scans: log.frames().len() }
    }

    pub(crate) fn of_outline(outline: &'a LogOutline) -> Self {
        Self {
            summary: outline.summary(),
            static_frames: outline.static_frames(),
            scans: outline.scans().len(),
        }
    }

    /// Returns are 0 where only an index was read.
    pub(crate) fn summary(self) -> &'a LogSummary {
        self.summary
    }

    pub(crate) fn static_frames(self) -> &'a StaticFrames {
        self.static_frames
    }

    pub(crate) fn scans(self) -> usize {
        self.scans
    }
}

/// Where the sensor sat and how clocks differ where a LAS file is brought back into the sensor's frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Mapper {
    /// `None` where it is not known before the log is open.
    pub(crate) body_from_sensor: Option<Isometry3<f64>>,
    pub(crate) time_offset_ns: i64,
    pub(crate) max_gap_ns: Option<i64>,
}

impl LogArgs {
    /// The file or folder that was named.
    pub(crate) fn path(&self) -> &Path {
        &self.log
    }

    /// The same log with the times of its points, where those are not to be used.
    pub(crate) fn with_point_times(&self) -> Option<Self> {
        (self.reading.point_time == PointTime::Ignore).then(|| {
            let reading = ReadingArgs { point_time: PointTime::Auto, ..self.reading.clone() };
            Self { log: self.log.clone(), reading }
        })
    }

    /// The same log, each scan taken for an instant: that of its stamp, whichever that is.
    pub(crate) fn without_point_times(&self) -> Self {
        let stamp = StampAt::default();
        let reading = ReadingArgs { point_time: PointTime::Ignore, stamp, ..self.reading.clone() };
        Self { log: self.log.clone(), reading }
    }

    /// Opens the log in so many threads.
    pub(crate) fn open(&self, mapper: &Mapper, threads: usize) -> anyhow::Result<Box<dyn ScanLog>> {
        Ok(in_threads(threads, || self.reading.open(&self.log, mapper).map_err(swapped))??)
    }

    /// Looks at the index of the log.
    pub(crate) fn outline(&self, mapper: &Mapper) -> Result<LogOutline, LogError> {
        outline_log(&self.log, &self.reading.options(&self.log, mapper)?).map_err(swapped)
    }

    /// Everything that the log holds, also where it cannot be opened without being told more.
    pub(crate) fn survey(&self, mapper: &Mapper, threads: usize) -> anyhow::Result<LogSurvey> {
        let options = self.reading.options(&self.log, mapper)?;
        Ok(in_threads(threads, || survey_log(&self.log, &options))??)
    }
}

/// Opens a log in so many threads, but no more than there are cores: whether they are too many is told once it is open.
pub(crate) fn in_threads<R: Send>(threads: usize, open: impl FnOnce() -> R + Send) -> anyhow::Result<R> {
    Ok(dmp::in_threads(threads.clamp(1, Config::default().threads), open)?)
}

/// What looks like a trajectory in the log's place is told as that.
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

impl ReadingArgs {
    /// Opens a log.
    pub(crate) fn open(&self, log: &Path, mapper: &Mapper) -> Result<Box<dyn ScanLog>, LogError> {
        open_log(log, &self.options(log, mapper)?)
    }

    fn options(&self, log: &Path, mapper: &Mapper) -> Result<LogOptions, LogError> {
        let made_with = |path: &PathBuf| -> Result<MadeWith, LogError> {
            let Some(body_from_sensor) = mapper.body_from_sensor else {
                let problem = "--made-with needs to know where the sensor sat before the log is open: give --extrinsic for \
                               all runs, as identity, X,Y,Z,QX,QY,QZ,QW or calib:FILE"
                    .to_owned();
                return Err(LogError::Option { path: log.to_owned(), problem });
            };
            Ok(MadeWith {
                trajectory: read_trajectory(path)?.trajectory,
                body_from_sensor,
                time_offset_ns: mapper.time_offset_ns,
                max_gap_ns: mapper.max_gap_ns,
                scan_period_ns: self.scan_period,
            })
        };
        Ok(LogOptions {
            topic: self.topic.clone(),
            point_time: self.point_time,
            stamp_at: self.stamp,
            made_with: self.made_with.as_ref().map(made_with).transpose()?,
        })
    }
}
