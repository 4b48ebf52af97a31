//! How a log is to be read.

use crate::{BinLayout, MadeWith, PointTime, StampAt};

/// How a log is to be read.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct LogOptions {
    /// The topic with the scans; `None` where the log has only one.
    pub topic: Option<String>,
    /// What the times of the points mean.
    pub point_time: PointTime,
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
