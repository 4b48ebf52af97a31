//! What is in a log and in trajectories beside it: found, and as JSON.

use dmp::Pairing;
use dmp_draw::text::count;
use dmp_log::{Damage, FrameInfo, LogSurvey, ScanStream, TopicInfo, shown_path, stamp_jumps};
use dmp_sensor::{Isometry3, PinholeCamera};
use serde::Serialize;

use crate::console::one_line;
use crate::inputs::LoadedRun;

/// Jumps of stamps that are named.
const JUMPS_NAMED: usize = 5;

/// What is in a log. Serialised, it is the command's JSON: schema `dmp-info/1`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Info {
    /// Always `dmp-info/1`.
    pub(super) schema: &'static str,
    /// Version of this program.
    pub(super) dmp_version: &'static str,
    /// The file or folder.
    pub(super) log: String,
    pub(super) format: &'static str,
    pub(super) bytes: u64,
    /// Identifies the log cheaply: length and ends, not every byte.
    pub(super) fingerprint: String,
    /// Every topic, whether it can be read or not; empty for a format without topics.
    pub(super) topics: Vec<Topic>,
    /// The scans: of every topic that has some, or of the log where it has no topics.
    pub(super) streams: Vec<Stream>,
    /// Frames that hang on one another without moving (`/tf_static`).
    pub(super) frames: Vec<Frame>,
    pub(super) trajectories: Vec<TrajectoryInfo>,
    /// What is lost, but for single scans of a stream.
    pub(super) damage: Vec<Lost>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Topic {
    pub(super) name: String,
    #[serde(rename = "type")]
    pub(super) message_type: String,
    pub(super) messages: u64,
    /// When the first and the last message were recorded, nanoseconds.
    pub(super) span_ns: Option<[u64; 2]>,
    /// Messages less one, over that time.
    pub(super) rate_hz: Option<f64>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Frame {
    pub(super) parent: String,
    pub(super) child: String,
    /// `parent_from_child` as x, y, z (metres), qx, qy, qz, qw.
    pub(super) parent_from_child: [f64; 7],
}

/// The scans of one topic.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Stream {
    /// Null for a log without topics.
    pub(super) topic: Option<String>,
    /// What keeps it from being scored as it is; null where nothing does.
    pub(super) problem: Option<String>,
    /// Null where no scan can be read.
    pub(super) scans: Option<Scans>,
    /// Scans that are lost.
    pub(super) damage: Vec<Lost>,
}

/// What is known of scans.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[expect(clippy::struct_field_names, reason = "`scans` is how many, as in the other JSON")]
pub(super) struct Scans {
    /// The name of the sensor's frame.
    pub(super) frame_id: Option<String>,
    pub(super) fields: Vec<Field>,
    /// Bytes from one point to the next.
    pub(super) point_bytes: u32,
    /// How the times of points are understood; null where there are none, or they are not understood.
    pub(super) point_times: Option<String>,
    /// The camera whose depth images the scans are; null for other sensors.
    pub(super) camera: Option<Camera>,
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
    /// How often a stamp is before that of the scan in front of it.
    pub(super) steps_back: usize,
    /// Scans with the stamp of another.
    pub(super) same_stamp: usize,
    /// Whether checksums guard all points.
    pub(super) has_checksums: bool,
    /// What was guessed or ignored.
    pub(super) notes: Vec<String>,
}

/// A depth camera, pixels.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(super) struct Camera {
    /// Width and height of an image.
    pub(super) size_px: [u32; 2],
    /// fx and fy.
    pub(super) focal_px: [f64; 2],
    /// cx and cy.
    pub(super) centre_px: [f64; 2],
    /// k1, k2, p1, p2, k3.
    pub(super) distortion: [f64; 5],
    /// Units of depth a metre.
    pub(super) units_per_m: Option<f64>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Field {
    pub(super) name: String,
    #[serde(rename = "type")]
    pub(super) kind: &'static str,
    pub(super) offset_bytes: u32,
    /// `coordinate`, `time` or `not_used`.
    pub(super) meaning: &'static str,
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
    /// How its poses are found.
    pub(super) pairing: Pairing,
    /// Scans stamped within the trajectory; line by line: scans that have a line.
    pub(super) scans_within: usize,
    /// Poses that were sorted by time.
    pub(super) out_of_order: usize,
    /// Repeated poses that were excluded.
    pub(super) repeated: usize,
    pub(super) notes: Vec<String>,
}

impl Info {
    pub(super) fn new(survey: LogSurvey, trajectories: &[LoadedRun], time_offset_ns: i64) -> Self {
        // Trajectories are held against the first stream: what several have in common is one clock.
        let log = survey.streams.iter().find_map(|stream| stream.log.as_deref());
        let frames = log.map(dmp_log::ScanLog::frames).unwrap_or_default();
        Self {
            schema: "dmp-info/1",
            dmp_version: env!("CARGO_PKG_VERSION"),
            log: shown_path(&survey.path),
            format: survey.format.name(),
            bytes: survey.bytes,
            fingerprint: survey.fingerprint,
            topics: survey.topics.into_iter().map(Topic::new).collect(),
            trajectories: trajectories
                .iter()
                .map(|run| TrajectoryInfo::new(run, frames, time_offset_ns))
                .collect(),
            frames: survey.static_frames.iter().map(Frame::new).collect(),
            streams: survey.streams.into_iter().map(Stream::new).collect(),
            damage: survey.damage.into_iter().map(Lost::new).collect(),
        }
    }

    /// Whether anything is lost.
    pub(super) fn is_damaged(&self) -> bool {
        !self.damage.is_empty() || self.streams.iter().any(|stream| !stream.damage.is_empty())
    }
}

impl Frame {
    fn new((parent, child, pose): (&str, &str, &Isometry3<f64>)) -> Self {
        let (t, q) = (pose.translation.vector, pose.rotation.coords);
        let parent_from_child = [t.x, t.y, t.z, q.x, q.y, q.z, q.w];
        Self { parent: parent.into(), child: child.into(), parent_from_child }
    }
}

impl Topic {
    fn new(topic: TopicInfo) -> Self {
        let TopicInfo { name, message_type, messages, span_ns } = topic;
        let span_s = span_ns.map(|(first, last)| last.saturating_sub(first) as f64 / 1e9);
        // Messages all at once have no rate.
        let rate_hz = span_s.filter(|&s| s > 1e-3).map(|s| messages.saturating_sub(1) as f64 / s);
        Self { name, message_type, messages, span_ns: span_ns.map(|(first, last)| [first, last]), rate_hz }
    }
}

impl Stream {
    fn new(stream: ScanStream) -> Self {
        let ScanStream { topic, log, damage, problem } = stream;
        let scans = log.map(|log| {
            let (summary, frames) = (log.summary(), log.frames());
            let field = |field: &dmp_log::FieldInfo| Field {
                name: field.name.clone(),
                kind: field.kind,
                offset_bytes: field.offset_bytes,
                meaning: field.meaning.name(),
            };
            Scans {
                frame_id: summary.frame_id.clone(),
                fields: summary.fields.iter().map(field).collect(),
                point_bytes: summary.point_bytes,
                point_times: summary.point_times.clone(),
                camera: summary.camera.map(|camera| Camera::new(&camera, summary.depth_units_per_m)),
                scans: frames.len(),
                returns: summary.returns,
                returns_per_scan: spread(frames.iter().map(|frame| frame.returns).collect()),
                span_ns: summary.span_ns.map(|(first, last)| [first, last]),
                period_ns: summary.period_ns,
                rate_hz: rate_hz(summary.period_ns),
                steps_back: frames.windows(2).filter(|pair| pair[1].stamp_ns < pair[0].stamp_ns).count(),
                same_stamp: same_stamp(frames),
                has_checksums: summary.has_checksums,
                notes: summary
                    .notes
                    .clone()
                    .into_iter()
                    .chain(summary.without_checksums().map(Into::into))
                    .chain(jumps(frames))
                    .collect(),
            }
        });
        let problem = problem.map(|problem| one_line(&problem.as_shown().into()));
        Self { topic, problem, scans, damage: damage.into_iter().map(Lost::new).collect() }
    }
}

impl Camera {
    fn new(camera: &PinholeCamera, units_per_m: Option<f64>) -> Self {
        let lens = camera.distortion();
        let ([k1, k2, k3], [p1, p2]) = (lens.radial, lens.tangential);
        Self {
            size_px: camera.size_px(),
            focal_px: camera.focal_px(),
            centre_px: camera.centre_px(),
            distortion: [k1, k2, p1, p2, k3],
            units_per_m,
        }
    }
}

impl Lost {
    fn new(damage: Damage) -> Self {
        Self { place: damage.place, what: damage.what }
    }
}

impl TrajectoryInfo {
    fn new(run: &LoadedRun, frames: &[FrameInfo], time_offset_ns: i64) -> Self {
        let stamps_ns = run.trajectory.stamps_ns();
        let span_ns = stamps_ns.and_then(|stamps| Some([*stamps.first()?, *stamps.last()?]));
        let poses = run.trajectory.len();
        let log_stamped = frames.iter().all(|frame| frame.stamp_ns.is_some());
        let (pairing, scans_within) = match span_ns {
            Some([first, last]) if log_stamped => {
                let stamp_ns = |frame: &FrameInfo| frame.stamp_ns?.checked_add(time_offset_ns);
                let within =
                    |frame: &&FrameInfo| stamp_ns(frame).is_some_and(|ns| (first..=last).contains(&ns));
                (Pairing::ByStamp, frames.iter().filter(within).count())
            }
            _ => (Pairing::ByLine, frames.len().min(poses)),
        };
        let period_ns = stamps_ns.and_then(median_step_ns);
        Self {
            name: run.name.clone(),
            file: run.shown(),
            format: run.format,
            fingerprint: run.fingerprint.clone(),
            poses,
            span_ns,
            period_ns,
            rate_hz: rate_hz(period_ns),
            pairing,
            scans_within,
            out_of_order: run.out_of_order,
            repeated: run.repeated,
            notes: run.notes.clone(),
        }
    }
}

fn spread(mut values: Vec<u64>) -> Option<Spread> {
    values.sort_unstable();
    Some(Spread { min: *values.first()?, median: values[values.len() / 2], max: *values.last()? })
}

/// Where stamps jump, in words.
fn jumps(frames: &[FrameInfo]) -> Vec<String> {
    let stamps: Vec<(usize, i64)> =
        frames.iter().enumerate().filter_map(|(number, frame)| Some((number, frame.stamp_ns?))).collect();
    let jumps = stamp_jumps(&stamps);
    let more = jumps.len().saturating_sub(JUMPS_NAMED);
    let named = jumps.iter().take(JUMPS_NAMED).map(ToString::to_string);
    named.chain((more > 0).then(|| format!("stamps jump at {} more places", count(more as u64)))).collect()
}

/// Scans with the stamp of another, those that have it first not counted.
fn same_stamp(frames: &[FrameInfo]) -> usize {
    let mut stamps_ns: Vec<i64> = frames.iter().filter_map(|frame| frame.stamp_ns).collect();
    let stamped = stamps_ns.len();
    stamps_ns.sort_unstable();
    stamps_ns.dedup();
    stamped - stamps_ns.len()
}

fn median_step_ns(stamps_ns: &[i64]) -> Option<i64> {
    let mut steps: Vec<i64> = stamps_ns.windows(2).map(|pair| pair[1].saturating_sub(pair[0])).collect();
    steps.sort_unstable();
    steps.get(steps.len() / 2).copied()
}

fn rate_hz(period_ns: Option<i64>) -> Option<f64> {
    period_ns.filter(|&ns| ns > 0).map(|ns| 1e9 / ns as f64)
}
