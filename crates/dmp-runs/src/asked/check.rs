//! Validates settings before any file is opened.

use dmp_lengths::thousands;
use dmp_report::SegmentLength;
use dmp_sensor::Isometry3;

use crate::asked::config::Config;
use crate::asked::error::EvaluateError;
use crate::asked::setting_name::SettingName;

/// Memory of a pose of a run, bytes: a stamp and the pose, as they are read, vetted, and held in each frame in use.
pub const POSE_BYTES: usize = 6 * (size_of::<Isometry3<f64>>() + size_of::<i64>());
/// The program itself, bytes.
const PROGRAM_BYTES: usize = 16 << 20;

impl Config {
    /// Checks the memory before poses are read: so many of all runs, the longest of them in a file of so many bytes.
    ///
    /// # Errors
    /// When they need more memory than is given, whatever the log.
    pub fn check_poses(&self, poses: u64, longest_bytes: u64) -> Result<(), EvaluateError> {
        let held = usize::try_from(poses).unwrap_or(usize::MAX).saturating_mul(POSE_BYTES);
        let text = usize::try_from(longest_bytes).unwrap_or(usize::MAX);
        let needed = held.saturating_add(text).saturating_add(PROGRAM_BYTES);
        if self.memory_bytes < needed {
            return Err(EvaluateError::TooLittleForPoses { asked: self.memory_bytes, needed, poses });
        }
        Ok(())
    }

    /// Checks every setting separately, before any file is opened.
    ///
    /// # Errors
    /// The first invalid setting, with its value and what it must be.
    pub fn check(&self) -> Result<(), EvaluateError> {
        // If only one end is given, the other may depend on the log.
        match self.scales {
            Some(scales) => {
                let (min_m, max_m) = self.ranges_m(scales);
                check_ranges(min_m, max_m)?;
            }
            None => check_ranges(self.min_range_m.unwrap_or(0.0), self.max_range_m.unwrap_or(MAX_RANGE_M))?,
        }
        if let Some(segment) = self.segment {
            let (length, unit) = match segment {
                SegmentLength::Metres(m) => (m, "m"),
                SegmentLength::Seconds(s) => (s, "s"),
                SegmentLength::Scans(scans) => (scans as f64, "scans"),
            };
            if !(length > 0.0 && length.is_finite()) {
                return bad(SettingName::Segment, format!("{length} {unit}"), "it must be positive");
            }
        }
        match self.voxel_m {
            Some(m) if !(0.01..=2.0).contains(&m) => {
                return bad(SettingName::Voxel, format!("{m} m"), "it must lie between 0.01 and 2 m");
            }
            _ => {}
        }
        if let Some(sigma_m) = self.sigma_m.filter(|&m| !(m > 0.0 && m.is_finite())) {
            return bad(SettingName::Sigma, format!("{sigma_m} m"), "it must be positive");
        }
        if let Some(m) = self.same_within_m.filter(|&m| !(m >= 0.0 && m.is_finite())) {
            return bad(SettingName::SameWithin, format!("{m} m"), "it must be 0 or more");
        }
        if self.every == 0 {
            return bad(SettingName::Every, "0".into(), "it must be 1 or more");
        }
        self.returns.check()?;
        if self.threads == 0 || self.threads > 1024 {
            return bad(SettingName::Threads, self.threads.to_string(), "it must lie between 1 and 1024");
        }
        if self.memory_bytes < 32 << 20 {
            return bad(
                SettingName::Memory,
                format!("{} bytes", thousands(self.memory_bytes)),
                "it must be 32 MiB or more",
            );
        }
        Ok(())
    }
}

/// No supported sensor measures farther, metres.
const MAX_RANGE_M: f64 = 1000.0;

/// Checks the ranges in use.
///
/// # Errors
/// When they do not rise, or are too large.
pub(crate) fn check_ranges(min_range_m: f64, max_range_m: f64) -> Result<(), EvaluateError> {
    let fit = min_range_m >= 0.0 && min_range_m < max_range_m && max_range_m <= MAX_RANGE_M;
    if fit {
        return Ok(());
    }
    let value = format!("{min_range_m} to {max_range_m} m");
    bad(SettingName::Ranges, value, "they must rise from 0 or more to at most 1000 m")
}

fn bad(setting: SettingName, value: String, why: &'static str) -> Result<(), EvaluateError> {
    Err(EvaluateError::setting(setting, value, why))
}
