//! Reasons why a trajectory has no pose for a log's scans.

use crate::asked::setting_name::SettingName;

/// Why a trajectory has poses for none or very few of a log's scans. All times in seconds; those of the log with the
/// time offset.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Unposed {
    /// The trajectory has fewer than two poses.
    TooFewPoses,
    /// The log's stamps are all equal.
    SameStamps {
        /// Their value.
        stamp_s: f64,
    },
    /// The log and the trajectory do not overlap in time.
    Apart {
        /// First and last stamp of the log.
        log_s: [f64; 2],
        /// First and last stamp of the trajectory.
        poses_s: [f64; 2],
        /// The gap from the end of one to the beginning of the other.
        gap_s: f64,
        /// The time offset, in place of the present one, that aligns their beginnings as far as the stamps show it: mostly to a second.
        offset_s: f64,
    },
    /// They overlap, but the trajectory has gaps there.
    Gaps {
        /// First and last stamp of the log.
        log_s: [f64; 2],
        /// First and last stamp of the trajectory.
        poses_s: [f64; 2],
    },
}

impl Unposed {
    /// In words, with `name`'s names for settings.
    pub fn message_with(&self, run: &str, name: &dyn Fn(SettingName) -> String) -> String {
        let spans = |[first, last]: &[f64; 2], [start, end]: &[f64; 2]| {
            format!("the log spans {first:.3} to {last:.3} s, the trajectory {start:.3} to {end:.3} s")
        };
        match self {
            Self::TooFewPoses => "the trajectory holds too few poses".to_owned(),
            Self::SameStamps { stamp_s } => {
                format!("the log's stamps are all the same, {stamp_s:.3} s")
            }
            Self::Apart { log_s, poses_s, gap_s, offset_s } => format!(
                "{}; they are {gap_s:.3} s apart. If their clocks differ, shift the log's: {} aligns their \
                 beginnings to a second",
                spans(log_s, poses_s),
                SettingName::TimeOffset.for_run(run, &format!("{offset_s:.3}"), name)
            ),
            Self::Gaps { log_s, poses_s } => format!(
                "{}; gaps in the trajectory longer than {} are not interpolated over",
                spans(log_s, poses_s),
                name(SettingName::MaxTimeGap)
            ),
        }
    }
}
