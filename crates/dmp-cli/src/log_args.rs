use std::path::PathBuf;

use clap::Args;
use dmp_log::{LogError, LogOptions, LogSurvey, PointTime, ScanLog, StampAt, open_log, survey_log};

/// The log and how it is to be read.
#[derive(Debug, Args)]
pub(crate) struct LogArgs {
    /// The log: FILE.mcap with PointCloud2, a folder with one, or a folder with one scan a file (.bin, .pcd, .ply,
    /// .las, .laz)
    #[arg(value_name = "LOG")]
    log: PathBuf,
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
}

impl LogArgs {
    pub(crate) fn open(&self) -> Result<Box<dyn ScanLog>, LogError> {
        open_log(&self.log, &self.options())
    }

    /// Everything that the log holds, also where it cannot be opened without being told more.
    pub(crate) fn survey(&self) -> Result<LogSurvey, LogError> {
        survey_log(&self.log, &self.options())
    }

    fn options(&self) -> LogOptions {
        let Self { topic, point_time, stamp, .. } = self;
        LogOptions { topic: topic.clone(), point_time: *point_time, stamp_at: *stamp }
    }
}
