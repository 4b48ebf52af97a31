//! What was read, used and dropped, in a report.

use std::collections::BTreeMap;

use dmp_log::NO_CHECKSUMS;
use dmp_revisit::apart::Moments;
use serde::{Deserialize, Serialize};

use super::conventions::ConventionsReport;
use super::pairing::Pairing;
use super::pose_at::PoseAt;
use super::settings::SegmentReport;

/// What was read, used and dropped.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InputReport {
    /// The log.
    pub log: String,
    /// Its format.
    pub format: String,
    /// Identifies the log: see `docs/json.md`.
    pub fingerprint: String,
    /// Its length, bytes.
    pub bytes: u64,
    /// Whether checksums guard all its points; null where the one who wrote this did not look.
    #[serde(default)]
    pub has_checksums: Option<bool>,
    /// The topic read.
    pub topic: Option<String>,
    /// How the times of points were understood; null where there are none.
    pub point_times: Option<String>,
    /// First and last stamp, nanoseconds.
    pub span_ns: Option<(i64, i64)>,
    /// Scans that can be read.
    pub scans: usize,
    /// Scans used: those that some run has a pose for.
    pub scans_used: usize,
    /// Returns of all scans that can be read.
    pub returns: u64,
    /// Where the returns of a scan lie, of some scans: by this a turn of a run is put into metres.
    pub returns_at: Moments,
    /// Returns used, of scans that some run has a pose for.
    pub returns_used: u64,
    /// Returns dropped, by reason. Used and dropped add up to all.
    pub dropped: DropReport,
    /// The runs' trajectories and maps.
    pub runs: Vec<RunInputReport>,
    /// What was guessed about the log.
    pub notes: Vec<String>,
    /// What of the log is lost.
    pub damage: Vec<String>,
}

impl InputReport {
    /// What to know of a log that no checksum guards, for people.
    pub fn without_checksums(&self) -> Option<&'static str> {
        (self.has_checksums == Some(false)).then_some(NO_CHECKSUMS)
    }
}

/// Returns dropped by reason, every reason listed.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct DropReport(pub BTreeMap<String, u64>);

/// A run's inputs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunInputReport {
    /// Name of the run.
    pub name: String,
    /// The file or topic of the trajectory; null where the caller did not say.
    pub file: Option<String>,
    /// Its format; null where the caller did not say.
    pub format: Option<String>,
    /// Poses of the trajectory.
    pub poses: usize,
    /// Where the sensor sits on its body: x, y, z (metres), qx, qy, qz, qw.
    pub body_from_sensor: [f64; 7],
    /// Where that is from, in words.
    pub body_from_sensor_source: String,
    /// The frame that the run is scored in, which follows from its way: takes places of its trajectory's frame
    /// there. x, y, z (metres), qx, qy, qz, qw.
    pub world_from_own: [f64; 7],
    /// How its poses are found.
    pub pairing: Pairing,
    /// At which instant of its scan a pose holds whose stamp is the scan's.
    #[serde(default)]
    pub pose_at: PoseAt,
    /// What was added to the log's stamps before they were looked up in its trajectory, seconds.
    #[serde(default)]
    pub time_offset_s: f64,
    /// What the scans say of its clock and mounting; null where nobody looked.
    #[serde(default)]
    pub conventions: Option<ConventionsReport>,
    /// Longest gap between poses that is interpolated over, seconds.
    pub max_time_gap_s: f64,
    /// The longest time between two poses of it, seconds; null where they have no stamps.
    #[serde(default)]
    pub longest_gap_s: Option<f64>,
    /// Scans that lie between poses too far apart to say where they were made.
    #[serde(default)]
    pub scans_between_poses: usize,
    /// Scans without a pose in this run.
    pub scans_without_pose: usize,
    /// How its path was cut.
    pub segments: SegmentReport,
    /// Its map: `fused`, or the file given.
    pub map: String,
    /// What was made of a map that was given: its unit where that is not plainly the metre, the samples of a mesh.
    pub map_notes: Vec<String>,
    /// What was guessed about the trajectory.
    pub notes: Vec<String>,
}
