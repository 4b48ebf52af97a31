//! How a log is to be read.

use crate::{BinLayout, MadeWith, PointTime, StampAt};

/// How a log is to be read.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct LogOptions {
    /// The topic with the scans; `None` where the log has only one. `NAME:FRAME` or `:FRAME` where a topic has the scans of
    /// several sensors: those of this frame (`frame_id`).
    pub topic: Option<String>,
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
    /// For those who read every scan anyway. Of a bag whose chunks end in a scan no more than their starts are read to open it:
    /// the log is read once less. A chunk that is damaged further on is [`LogError::Unchecked`](crate::LogError::Unchecked) when
    /// its scan is read; opened without this, the log goes without that scan.
    #[serde(skip)]
    pub is_checked_as_read: bool,
}

impl LogOptions {
    /// As little as can be asked of a log: its scans, each an instant.
    pub(crate) fn without_times() -> Self {
        Self { point_time: PointTime::Ignore, ..Self::default() }
    }

    /// The name of the topic, and the frame of its scans.
    pub(crate) fn topic_and_frame(&self) -> (Option<&str>, Option<&str>) {
        let Some(topic) = self.topic.as_deref() else { return (None, None) };
        let (name, frame) = topic.split_once(':').map_or((topic, None), |(name, frame)| (name, Some(frame)));
        (Some(name).filter(|name| !name.is_empty()), frame)
    }
}
