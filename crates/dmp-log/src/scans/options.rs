//! How a log is to be read.

use crate::{BinLayout, MadeWith, PointTime, StampAt};

/// How a log is to be read.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct LogOptions {
    /// The topic with the scans; `None` where the log has only one.
    pub topic: Option<String>,
    /// The frame of the scans, where the topic has those of several sensors.
    pub scan_frame: Option<String>,
    /// What the times of the points mean.
    pub point_time: PointTime,
    /// The field of a point that holds its time, as `curvature`, or the two that do, as `sec + nsec`; `None`: by names and values.
    pub point_time_field: Option<String>,
    /// Which instant of a scan its stamp is.
    pub stamp_at: StampAt,
    /// How the points of files without a header are laid out; `None`: as their values show.
    pub bin_layout: Option<BinLayout>,
    /// What a file in world coordinates was made with; without it such a file is no log.
    pub made_with: Option<MadeWith>,
}

impl LogOptions {
    /// As little as can be asked of a log: its scans, each an instant.
    pub(crate) fn without_times() -> Self {
        Self { point_time: PointTime::Ignore, ..Self::default() }
    }
}
