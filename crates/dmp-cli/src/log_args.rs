use std::path::PathBuf;

use clap::Args;
use dmp_log::{LogError, LogOptions, PointTime, ScanLog, open_log};

/// The log and how it is to be read.
#[derive(Debug, Args)]
pub(crate) struct LogArgs {
    /// The log: FILE.mcap with PointCloud2, a folder with one, or a folder of KITTI scans (.bin)
    #[arg(value_name = "LOG")]
    log: PathBuf,
    /// The topic with the scans, where the log has several
    #[arg(long, value_name = "NAME", help_heading = "Input")]
    topic: Option<String>,
    /// Times of points: `s`, `ms`, `us` or `ns` after the scan's stamp, `absolute-s` … `absolute-ns` on the
    /// clock of the stamps, `ignore`, or `auto`: found from the values
    #[arg(
        long,
        value_name = "UNIT",
        default_value = "auto",
        hide_default_value = true,
        help_heading = "Input"
    )]
    point_time: PointTime,
}

impl LogArgs {
    pub(crate) fn open(&self) -> Result<Box<dyn ScanLog>, LogError> {
        open_log(&self.log, &LogOptions { topic: self.topic.clone(), point_time: self.point_time })
    }
}
