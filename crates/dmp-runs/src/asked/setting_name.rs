//! Names of the settings that messages mention.

use std::fmt;

/// A setting of [`Config`](crate::Config), of a [`Run`](crate::Run) or of a quick score.
///
/// Its text (`Display`) is a plain name. A program with other names for its users passes them to
/// [`EvaluateError::message_with`](crate::EvaluateError::message_with) and
/// [`Note::message_with`](crate::Note::message_with).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum SettingName {
    /// [`Config::segment`](crate::Config::segment).
    Segment,
    /// [`Config::voxel_m`](crate::Config::voxel_m).
    Voxel,
    /// [`Config::min_range_m`](crate::Config::min_range_m) and [`Config::max_range_m`](crate::Config::max_range_m).
    Ranges,
    /// [`Config::sigma_m`](crate::Config::sigma_m).
    Sigma,
    /// [`Config::same_within`](crate::Config::same_within).
    SameWithin,
    /// [`Config::every`](crate::Config::every).
    Every,
    /// [`Config::returns`](crate::Config::returns).
    Returns,
    /// A quick score itself.
    Quick,
    /// [`Run::map`](crate::Run::map).
    Map,
    /// [`Config::time_offset_ns`](crate::Config::time_offset_ns); messages give it in seconds.
    TimeOffset,
    /// [`Run::pose_at`](crate::Run::pose_at).
    PoseAt,
    /// The pose format of a run's file: [`PosesAs`](crate::PosesAs).
    PosesAs,
    /// [`Run::body_from_sensor`](crate::Run::body_from_sensor).
    Extrinsic,
    /// [`LogOptions::point_time`](dmp_log::LogOptions::point_time).
    PointTime,
    /// [`LogOptions::stamp_at`](dmp_log::LogOptions::stamp_at).
    StampAt,
    /// The odometry between a run's poses: [`Trajectory::carried_by`](dmp_sensor::Trajectory::carried_by).
    Between,
    /// The effect of [`Vetted::mended`](crate::Vetted::mended).
    Mend,
    /// [`Config::max_time_gap_ns`](crate::Config::max_time_gap_ns).
    MaxTimeGap,
    /// [`Config::threads`](crate::Config::threads).
    Threads,
    /// [`Config::memory_bytes`](crate::Config::memory_bytes).
    Memory,
    /// [`Config::work_folder`](crate::Config::work_folder).
    WorkFolder,
    /// [`Config::save_maps`](crate::Config::save_maps).
    SaveMaps,
    /// [`Config::resume`](crate::Config::resume).
    Resume,
}

impl SettingName {
    /// The plain name in quotes, for messages without other names.
    pub fn quoted(self) -> String {
        format!("`{self}`")
    }

    /// The setting with a value for one run, as a shell takes it: `--pose-at a=end`, `--pose-at 'my
    /// run=end'`.
    pub fn for_run(self, run: &str, value: &str, name: &dyn Fn(Self) -> String) -> String {
        let word = format!("{run}={value}");
        let is_plain = |c: char| c.is_alphanumeric() || "-_./=,:+@%".contains(c);
        let word =
            if word.chars().all(is_plain) { word } else { format!("'{}'", word.replace('\'', r"'\''")) };
        format!("{} {word}", name(self))
    }
}

impl fmt::Display for SettingName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Segment => "segment",
            Self::Voxel => "voxel",
            Self::Ranges => "ranges",
            Self::Sigma => "sigma",
            Self::SameWithin => "same-within",
            Self::Every => "every",
            Self::Returns => "returns",
            Self::Quick => "quick",
            Self::Map => "map",
            Self::TimeOffset => "time-offset",
            Self::PoseAt => "pose-at",
            Self::PosesAs => "poses-as",
            Self::Extrinsic => "extrinsic",
            Self::PointTime => "point-time",
            Self::StampAt => "stamp-at",
            Self::Between => "between",
            Self::Mend => "mend",
            Self::MaxTimeGap => "max-time-gap",
            Self::Threads => "threads",
            Self::Memory => "memory",
            Self::WorkFolder => "work-folder",
            Self::SaveMaps => "save-maps",
            Self::Resume => "resume",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_option_is_a_word_to_a_shell() {
        let hint = |run: &str| SettingName::PoseAt.for_run(run, "end", &|setting| format!("--{setting}"));
        assert_eq!(hint("a/b-1.x"), "--pose-at a/b-1.x=end");
        assert_eq!(hint("my run"), "--pose-at 'my run=end'");
        assert_eq!(hint("it's $HOME"), r"--pose-at 'it'\''s $HOME=end'");
    }
}
