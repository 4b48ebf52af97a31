use dmp_log::{FrameInfo, ScanLog};
use serde::Serialize;

use crate::runs::LoadedRun;

/// What is in a log. Serialised, it is the command's JSON: schema `dmp-info/1`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Info {
    /// Always `dmp-info/1`.
    pub(super) schema: &'static str,
    /// Version of this program.
    pub(super) dmp_version: &'static str,
    /// The file, or the folder with the scans.
    pub(super) log: String,
    pub(super) format: &'static str,
    pub(super) bytes: u64,
    /// Identifies the log cheaply: length and ends, not every byte.
    pub(super) fingerprint: String,
    /// Every topic, whether it can be read or not; empty for a format without topics.
    pub(super) topics: Vec<Topic>,
    /// The topic that is read.
    pub(super) topic: Option<String>,
    /// The name of the sensor's frame.
    pub(super) frame_id: Option<String>,
    pub(super) fields: Vec<Field>,
    /// Bytes from one point to the next.
    pub(super) point_bytes: u32,
    /// How the times of points are understood; null where there are none.
    pub(super) point_times: Option<String>,
    pub(super) scans: usize,
    pub(super) returns: u64,
    /// Null where there is no scan.
    pub(super) returns_per_scan: Option<Spread>,
    /// First and last stamp, nanoseconds.
    pub(super) span_ns: Option<[i64; 2]>,
    /// Median time from scan to scan, nanoseconds.
    pub(super) period_ns: Option<i64>,
    /// Its inverse.
    pub(super) rate_hz: Option<f64>,
    pub(super) trajectories: Vec<TrajectoryInfo>,
    /// What was guessed or left aside.
    pub(super) notes: Vec<String>,
    pub(super) damage: Vec<Lost>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Topic {
    pub(super) name: String,
    #[serde(rename = "type")]
    pub(super) message_type: String,
    pub(super) messages: u64,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Field {
    pub(super) name: String,
    #[serde(rename = "type")]
    pub(super) kind: &'static str,
    pub(super) offset_bytes: u32,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(super) struct Spread {
    pub(super) min: u64,
    pub(super) median: u64,
    pub(super) max: u64,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Lost {
    pub(super) place: String,
    pub(super) what: String,
}

/// A trajectory beside the log.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct TrajectoryInfo {
    pub(super) name: String,
    pub(super) file: String,
    pub(super) format: &'static str,
    pub(super) fingerprint: String,
    pub(super) poses: usize,
    /// First and last stamp, nanoseconds; null where there are none.
    pub(super) span_ns: Option<[i64; 2]>,
    /// Median time from pose to pose, nanoseconds.
    pub(super) period_ns: Option<i64>,
    pub(super) rate_hz: Option<f64>,
    /// `by stamp` or `line by line`.
    pub(super) pairing: &'static str,
    /// Scans stamped within the trajectory; line by line: scans that have a line.
    pub(super) scans_within: usize,
    /// Poses that were put in order of time.
    pub(super) out_of_order: usize,
    /// Repeated poses that were left out.
    pub(super) repeated: usize,
    pub(super) notes: Vec<String>,
}

impl Info {
    pub(super) fn new(log: &dyn ScanLog, trajectories: &[LoadedRun]) -> Self {
        let (summary, frames) = (log.summary().clone(), log.frames());
        let topics = summary.topics.into_iter();
        let fields = summary.fields.into_iter();
        let damage = summary.damage.into_iter();
        Self {
            schema: "dmp-info/1",
            dmp_version: env!("CARGO_PKG_VERSION"),
            log: summary.path.display().to_string(),
            format: summary.format.name(),
            bytes: summary.bytes,
            fingerprint: summary.fingerprint,
            topics: topics
                .map(|t| Topic { name: t.name, message_type: t.message_type, messages: t.messages })
                .collect(),
            topic: summary.topic,
            frame_id: summary.frame_id,
            fields: fields
                .map(|f| Field { name: f.name, kind: f.kind, offset_bytes: f.offset_bytes })
                .collect(),
            point_bytes: summary.point_bytes,
            point_times: summary.point_times,
            scans: frames.len(),
            returns: summary.returns,
            returns_per_scan: spread(frames.iter().map(|frame| frame.returns).collect()),
            span_ns: summary.span_ns.map(|(first, last)| [first, last]),
            period_ns: summary.period_ns,
            rate_hz: rate_hz(summary.period_ns),
            trajectories: trajectories.iter().map(|run| TrajectoryInfo::new(run, frames)).collect(),
            notes: summary.notes,
            damage: damage.map(|damage| Lost { place: damage.place, what: damage.what }).collect(),
        }
    }
}

impl TrajectoryInfo {
    fn new(run: &LoadedRun, frames: &[FrameInfo]) -> Self {
        let LoadedRun { name, path, file } = run;
        let stamps_ns = file.trajectory.stamps_ns();
        let span_ns = stamps_ns.and_then(|stamps| Some([*stamps.first()?, *stamps.last()?]));
        let poses = file.trajectory.len();
        let log_stamped = frames.iter().all(|frame| frame.stamp_ns.is_some());
        let (pairing, scans_within) = match span_ns {
            Some([first, last]) if log_stamped => {
                let within =
                    |frame: &&FrameInfo| frame.stamp_ns.is_some_and(|ns| (first..=last).contains(&ns));
                ("by stamp", frames.iter().filter(within).count())
            }
            _ => ("line by line", frames.len().min(poses)),
        };
        let period_ns = stamps_ns.and_then(median_step_ns);
        Self {
            name: name.clone(),
            file: path.display().to_string(),
            format: file.format.name(),
            fingerprint: file.fingerprint.clone(),
            poses,
            span_ns,
            period_ns,
            rate_hz: rate_hz(period_ns),
            pairing,
            scans_within,
            out_of_order: file.out_of_order,
            repeated: file.repeated,
            notes: file.notes.clone(),
        }
    }
}

fn spread(mut values: Vec<u64>) -> Option<Spread> {
    values.sort_unstable();
    Some(Spread { min: *values.first()?, median: values[values.len() / 2], max: *values.last()? })
}

fn median_step_ns(stamps_ns: &[i64]) -> Option<i64> {
    let mut steps: Vec<i64> = stamps_ns.windows(2).map(|pair| pair[1].saturating_sub(pair[0])).collect();
    steps.sort_unstable();
    steps.get(steps.len() / 2).copied()
}

fn rate_hz(period_ns: Option<i64>) -> Option<f64> {
    period_ns.filter(|&ns| ns > 0).map(|ns| 1e9 / ns as f64)
}
