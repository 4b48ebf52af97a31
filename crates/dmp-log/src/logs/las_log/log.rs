//! The points of one LAS file as a log: cut into scans, and brought into the sensor's frame.

use super::clock::{self, gps_ns};
use super::cuts::{Cut, Cuts};
use super::made_with::MadeWith;
use crate::file::{ReadCount, fingerprint};
use crate::geometry::cloud::las_header::GpsTime;
use crate::geometry::cloud::las_points::LasPoints;
use crate::geometry::cloud::las_units;
use crate::geometry::cloud::las_units::ToMetres;
use crate::scans::of_frame;
use crate::{
    FieldInfo, FieldMeaning, FrameInfo, LogError, LogFormat, LogIndex, LogOptions, LogSetting, LogSummary,
    PlaceInFile, PointTime, ScanLog, ScanReader, StampAt,
};
use dmp_lengths::thousands;
use dmp_sensor::{Isometry3, Point3, Scan, Track, TrackCursor};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// One file, cut into scans by time.
#[derive(Debug)]
pub(crate) struct LasLog {
    path: PathBuf,
    made_with: MadeWith,
    to_metres: [f64; 3],
    cuts: Vec<Cut>,
    /// Points that could not be decoded on opening.
    lost: Vec<Range<u64>>,
    frames: Vec<FrameInfo>,
    summary: LogSummary,
    /// How it was opened.
    options: LogOptions,
    count: ReadCount,
}

impl LasLog {
    /// Reads all points once, and keeps of them which are of which time.
    pub(crate) fn open(path: &Path, options: &LogOptions) -> Result<Self, LogError> {
        let made_with = checked_options(path, options)?;
        let count = ReadCount::default();
        let mut points = LasPoints::open(path, &count)?.ahead();
        let Some(kind) = points.header().gps_time else {
            return Err(option(
                path,
                "the points have no gps_time: they cannot be put in order of time".into(),
            ));
        };
        let ToMetres { scale, note } = las_units::of(points.header()).map_err(|e| {
            let problem = "the coordinates are longitude and latitude: project them to metres first";
            LogError::malformed(path, e.place, problem)
        })?;
        let found = Cuts::of(&mut points, made_with)?;
        let mut notes = vec![format!(
            "cut into scans of {} s by gps_time, {}; places in the sensor's frame by the trajectory it was made with",
            made_with.scan_period_ns as f64 / 1e9,
            match kind {
                GpsTime::Week => "seconds of the GPS week",
                GpsTime::Standard => "GPS seconds less 1e9",
            }
        )];
        notes.extend(note);
        clock::check_overlap(path, kind, found.span_ns, made_with)?;
        if found.without_pose > 0 {
            notes.push(format!(
                "{} of {} points are at times without a pose: they are handed on as NaN",
                thousands(found.without_pose),
                thousands(found.returns)
            ));
        }
        let info = |cut: &Cut| FrameInfo { stamp_ns: Some(cut.stamp_ns), returns: cut.returns };
        let frames: Vec<FrameInfo> = found.scans.iter().map(info).collect();
        let field = |(name, offset_bytes): (&str, u32)| {
            let meaning = if name == "gps_time" { FieldMeaning::Time } else { FieldMeaning::Coordinate };
            FieldInfo::new(name, "float64", offset_bytes, meaning)
        };
        let mut summary = LogSummary {
            fields: [("x", 0), ("y", 8), ("z", 16), ("gps_time", 24)].map(field).into(),
            point_bytes: 32,
            point_times: Some("field `gps_time`: seconds on the clock of the stamps".into()),
            middle_ns: made_with.scan_period_ns / 2,
            sweep_ns: [0, made_with.scan_period_ns],
            notes,
            damage: found.damage,
            fingerprint: fingerprint::of_file(path, &count).map_err(|e| LogError::io(path, "read", e))?,
            bytes: std::fs::metadata(path).map_err(|e| LogError::io(path, "read", e))?.len(),
            ..LogSummary::of(path, LogFormat::Las)
        };
        summary.describe(&frames);
        let (path, made_with) = (path.into(), made_with.clone());
        let (cuts, lost) = (found.scans, found.lost);
        Ok(Self {
            path,
            made_with,
            to_metres: scale,
            cuts,
            lost,
            frames,
            summary,
            options: options.clone(),
            count,
        })
    }

    /// Bytes of the file in which each frame's points lie, others between them.
    pub(crate) fn scan_bytes(&self) -> Vec<u64> {
        let points = self.cuts.iter().map(|cut| cut.points.end).max().unwrap_or(0).max(1);
        let bytes = |cut: &Cut| {
            let share = u128::from(cut.points.end - cut.points.start) * u128::from(self.summary.bytes);
            u64::try_from(share / u128::from(points)).unwrap_or(self.summary.bytes)
        };
        self.cuts.iter().map(bytes).collect()
    }
}

fn option(path: &Path, problem: String) -> LogError {
    LogError::Option { path: path.into(), problem }
}

/// What the file was made with, and nothing that has no meaning for it.
fn checked_options<'a>(path: &Path, options: &'a LogOptions) -> Result<&'a MadeWith, LogError> {
    let Some(made_with) = &options.made_with else {
        let problem = "a LAS file has points in the world, without the place they were measured from (scans in the sensor's \
                       frame, one file each, are read as a folder): give the trajectory it was made with,";
        return Err(LogError::missing(path, problem, LogSetting::MadeWith, "TRAJECTORY"));
    };
    let refused = match options {
        LogOptions { topic: Some(topic), .. } => Some((LogSetting::Topic, topic.clone())),
        LogOptions { point_time, .. } if *point_time != PointTime::Auto => {
            Some((LogSetting::PointTime, point_time.to_string()))
        }
        LogOptions { point_time_field: Some(field), .. } => Some((LogSetting::PointTimeField, field.clone())),
        LogOptions { stamp_at, .. } if *stamp_at != StampAt::Start => {
            Some((LogSetting::StampAt, stamp_at.name().to_owned()))
        }
        _ => None,
    };
    match refused {
        Some((setting, value)) => {
            Err(LogError::setting(path, setting, value, "was given, but a LAS file is cut by its gps_time"))
        }
        None if made_with.trajectory.stamps_ns().is_none() => {
            Err(LogError::setting(path, LogSetting::MadeWith, "", "needs a trajectory with stamps"))
        }
        None => Ok(made_with),
    }
}

impl ScanLog for LasLog {
    fn summary(&self) -> &LogSummary {
        &self.summary
    }

    fn frames(&self) -> &[FrameInfo] {
        &self.frames
    }

    fn reader(&self) -> Result<Box<dyn ScanReader + '_>, LogError> {
        Ok(Box::new(LasReader { log: self, points: LasPoints::open(&self.path, &self.count)? }))
    }

    fn index(&self) -> Result<Option<LogIndex>, LogError> {
        Ok(Some(LogIndex::whole(&self.summary, &self.options)))
    }

    fn bytes_read(&self) -> Option<u64> {
        Some(self.count.bytes())
    }
}

#[derive(Debug)]
struct LasReader<'a> {
    log: &'a LasLog,
    points: LasPoints,
}

impl ScanReader for LasReader<'_> {
    fn read(&mut self, frame: usize, scan: &mut Scan) -> Result<(), LogError> {
        scan.clear();
        let log = self.log;
        let malformed =
            |problem: String| LogError::malformed(&log.path, PlaceInFile::Frame(frame as u64), problem);
        let cut = of_frame(&log.cuts, frame, &log.path)?;
        scan.stamp_ns = Some(cut.stamp_ns);
        let mut poses = log.made_with.poses();
        let mut at = cut.points.start;
        while at < cut.points.end {
            if let Some(lost) = log.lost.iter().find(|lost| lost.contains(&at)) {
                at = lost.end;
                continue;
            }
            let before_lost = log.lost.iter().map(|lost| lost.start).filter(|&start| start > at).min();
            let end = before_lost.unwrap_or(u64::MAX).min(cut.points.end);
            self.points.seek(at);
            let batch = self.points.read(end - at)?;
            let Some(times) = batch.gps_time() else { break };
            for (((x, y), z), time_s) in batch.x().zip(batch.y()).zip(batch.z()).zip(times) {
                let Some(time_ns) = gps_ns(time_s).filter(|&time_ns| cut.holds(time_ns)) else { continue };
                let [sx, sy, sz] = log.to_metres;
                let in_world = Point3::new(x * sx, y * sy, z * sz);
                scan.points_in_sensor_m.push(poses.in_sensor(time_ns, &in_world));
                scan.time_offsets_ns.push(time_ns - cut.stamp_ns);
            }
            at += batch.len() as u64;
        }
        if scan.len() as u64 != cut.returns {
            return Err(malformed("the file has changed since it was opened".into()));
        }
        Ok(())
    }
}

/// Where the sensor was at the times of points.
struct Poses<'a> {
    cursor: TrackCursor<'a>,
    time_offset_ns: i64,
}

impl MadeWith {
    fn poses(&self) -> Poses<'_> {
        let track = Track::new(&self.trajectory, self.body_from_sensor, self.gap_ns());
        Poses { cursor: track.cursor(), time_offset_ns: self.time_offset_ns }
    }
}

impl Poses<'_> {
    /// A point in the sensor's frame, metres; NaN where there is no pose.
    fn in_sensor(&mut self, time_ns: i64, in_world: &Point3<f64>) -> [f32; 3] {
        let stamp_ns = time_ns.checked_add(self.time_offset_ns);
        let pose: Option<Isometry3<f64>> = stamp_ns.and_then(|ns| self.cursor.world_from_sensor_at(ns));
        pose.map_or([f32::NAN; 3], |world_from_sensor| {
            let in_sensor = world_from_sensor.inverse_transform_point(in_world);
            [in_sensor.x as f32, in_sensor.y as f32, in_sensor.z as f32]
        })
    }
}
