//! The settings of a log that a message may speak of.

use std::fmt;

/// A setting of [`LogOptions`](crate::LogOptions) or of [`MadeWith`](crate::MadeWith).
///
/// As text (`Display`): its name there, between backticks. A program whose users know it by another name gives that to
/// [`LogError::message_with`](crate::LogError::message_with).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum LogSetting {
    /// [`LogOptions::topic`](crate::LogOptions::topic).
    Topic,
    /// [`LogOptions::point_time`](crate::LogOptions::point_time).
    PointTime,
    /// [`LogOptions::point_time_field`](crate::LogOptions::point_time_field).
    PointTimeField,
    /// [`LogOptions::stamp_at`](crate::LogOptions::stamp_at).
    StampAt,
    /// [`LogOptions::bin_layout`](crate::LogOptions::bin_layout).
    BinLayout,
    /// [`LogOptions::made_with`](crate::LogOptions::made_with).
    MadeWith,
    /// [`MadeWith::time_offset_ns`](crate::MadeWith::time_offset_ns).
    TimeOffset,
}

impl fmt::Display for LogSetting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Topic => "`topic`",
            Self::PointTime => "`point_time`",
            Self::PointTimeField => "`point_time_field`",
            Self::StampAt => "`stamp_at`",
            Self::BinLayout => "`bin_layout`",
            Self::MadeWith => "`made_with`",
            Self::TimeOffset => "`time_offset_ns`",
        })
    }
}
