//! Scans held in memory as a log: those of a caller's own code, or some that were read of another log.

use super::frame_info::of_frame;
use crate::file::fingerprint;
use crate::points::frames_to_look_at;
use crate::{
    FieldInfo, FieldMeaning, FrameInfo, LogError, LogFormat, LogSummary, ScanLog, ScanReader, StaticFrames,
};
use dmp_sensor::Scan;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Why scans in memory make no log. Scans count from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum MemoryLogFault {
    /// There are none.
    #[error("there is no scan")]
    NoScans,
    /// A scan has times, but not one for each point.
    #[error("scan {scan} has {times} times for {points} points: it needs one for each, or none")]
    TimesMismatch {
        /// The scan.
        scan: usize,
        /// Its points.
        points: usize,
        /// Its times.
        times: usize,
    },
    /// Some scans have a stamp, others have none.
    #[error("scan {with} has a stamp and scan {without} has none: all need one, or none may have one")]
    PartlyStamped {
        /// The first scan with a stamp.
        with: usize,
        /// The first without.
        without: usize,
    },
    /// The points of some scans have times, those of others have none.
    #[error("the points of scan {with} have times and those of scan {without} have none")]
    PartlyTimed {
        /// The first scan with points and times.
        with: usize,
        /// The first with points and without times.
        without: usize,
    },
    /// A point was measured at an instant beyond what nanoseconds in 64 bits can say.
    #[error("scan {scan}, point {point}: {offset_ns} ns after the stamp is beyond all times")]
    TimeOutOfRange {
        /// The scan.
        scan: usize,
        /// The point.
        point: usize,
        /// Its time after the scan's stamp, nanoseconds.
        offset_ns: i64,
    },
}

/// A log of scans that are held in memory: [`MemoryLog::new`] for a caller's own,
/// [`LogOutline::load`](crate::LogOutline::load) for some of a log on disk. Reading copies.
///
/// ```
/// use dmp_log::{MemoryLog, ScanLog};
/// use dmp_sensor::Scan;
///
/// let scan = |k: i64| Scan {
///     stamp_ns: Some(k * 100_000_000),
///     points_in_sensor_m: vec![[4.0, 3.0, 0.5], [8.0, -2.0, 1.5]],
///     time_offsets_ns: vec![0, 50_000_000],
/// };
/// let log = MemoryLog::new("my drive", (0..10).map(scan).collect())?;
/// assert_eq!((log.frames().len(), log.summary().returns), (10, 20));
/// assert_eq!(log.summary().period_ns, Some(100_000_000));
///
/// let mut read = Scan::default();
/// log.reader()?.read(3, &mut read)?;
/// assert_eq!(read, scan(3));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct MemoryLog {
    /// For each frame its number in the log, ascending, and the scan.
    scans: Vec<(usize, Scan)>,
    frames: Vec<FrameInfo>,
    summary: LogSummary,
    static_frames: StaticFrames,
    scans_in_log: usize,
}

impl MemoryLog {
    /// A log of these scans, in this order. `name` stands for it in messages and results, where others have
    /// their path.
    ///
    /// All scans have a stamp or none has, and so it is with the times of their points. Stamps need not ascend. Memory
    /// and time grow with the points; the scans are taken over, not copied.
    ///
    /// # Errors
    /// When there is no scan, the times of a scan are not as many as its points or beyond all times, or only some
    /// scans have stamps or times.
    pub fn new(name: impl Into<PathBuf>, scans: Vec<Scan>) -> Result<Self, MemoryLogFault> {
        check(&scans)?;
        let info = |scan: &Scan| FrameInfo { stamp_ns: scan.stamp_ns, returns: scan.len() as u64 };
        let frames: Vec<FrameInfo> = scans.iter().map(info).collect();
        let timed = scans.iter().any(|scan| !scan.time_offsets_ns.is_empty());
        let point_bytes = if timed { 20 } else { 12 };
        let (middle_ns, sweep_ns) = sweep_of(&scans);
        let mut summary = LogSummary {
            fields: fields(timed),
            point_bytes,
            point_times: timed.then(|| "nanoseconds after the stamp of the scan, in memory".to_owned()),
            middle_ns,
            sweep_ns,
            fingerprint: fingerprint::of_scans(&scans),
            ..LogSummary::of(&name.into(), LogFormat::Memory)
        };
        summary.describe(&frames);
        summary.bytes = summary.returns * u64::from(point_bytes);
        let scans_in_log = scans.len();
        let scans = scans.into_iter().enumerate().collect();
        Ok(Self { scans, frames, summary, static_frames: StaticFrames::default(), scans_in_log })
    }

    /// The frames of `log`, as `take` gives them by their number in it, once each.
    pub(crate) fn part_of(log: &dyn ScanLog, take: &mut dyn FnMut(usize) -> Option<Scan>) -> Self {
        let numbers =
            (0..log.frames().len()).map(|frame| (log.number_in_log(frame), log.frames().get(frame)));
        let held = numbers.filter_map(|(number, frame)| Some(((number, take(number)?), *frame?)));
        let (scans, frames) = held.unzip();
        Self {
            scans,
            frames,
            summary: log.summary().clone(),
            static_frames: log.static_frames().clone(),
            scans_in_log: log.scans_in_log(),
        }
    }

    /// Reads all frames of a log.
    pub(crate) fn of(log: &dyn ScanLog) -> Result<Self, LogError> {
        let (mut reader, mut scans) = (log.reader()?, Vec::with_capacity(log.frames().len()));
        for frame in 0..log.frames().len() {
            let mut scan = Scan::default();
            reader.read(frame, &mut scan)?;
            scans.push(scan);
        }
        let mut scans = scans.into_iter();
        Ok(Self::part_of(log, &mut |_| scans.next()))
    }
}

/// Whether these scans make a log.
fn check(scans: &[Scan]) -> Result<(), MemoryLogFault> {
    if scans.is_empty() {
        return Err(MemoryLogFault::NoScans);
    }
    for (scan, Scan { stamp_ns, points_in_sensor_m, time_offsets_ns }) in scans.iter().enumerate() {
        let (points, times) = (points_in_sensor_m.len(), time_offsets_ns.len());
        if times != 0 && times != points {
            return Err(MemoryLogFault::TimesMismatch { scan, points, times });
        }
        let stamp_ns = stamp_ns.unwrap_or(0);
        let beyond = |offset_ns: &i64| stamp_ns.checked_add(*offset_ns).is_none();
        if let Some(point) = time_offsets_ns.iter().position(beyond) {
            let offset_ns = time_offsets_ns.get(point).copied().unwrap_or_default();
            return Err(MemoryLogFault::TimeOutOfRange { scan, point, offset_ns });
        }
    }
    let first = |wanted: &dyn Fn(&Scan) -> bool| scans.iter().position(wanted);
    let is_stamped = |scan: &Scan| scan.stamp_ns.is_some();
    if let (Some(with), Some(without)) = (first(&is_stamped), first(&|scan| !is_stamped(scan))) {
        return Err(MemoryLogFault::PartlyStamped { with, without });
    }
    let is_timed = |scan: &Scan| !scan.time_offsets_ns.is_empty();
    match (first(&is_timed), first(&|scan| !scan.is_empty() && !is_timed(scan))) {
        (Some(with), Some(without)) => Err(MemoryLogFault::PartlyTimed { with, without }),
        _ => Ok(()),
    }
}

fn fields(timed: bool) -> Vec<FieldInfo> {
    let coordinate = |(name, offset)| FieldInfo::new(name, "float32", offset, FieldMeaning::Coordinate);
    let mut fields: Vec<FieldInfo> = [("x", 0), ("y", 4), ("z", 8)].map(coordinate).into();
    fields.extend(timed.then(|| FieldInfo::new("time", "int64", 12, FieldMeaning::Time)));
    fields
}

/// From the stamp to the middle of a scan, and to its first and its last return, nanoseconds, from the same few scans as
/// of a log on disk.
fn sweep_of(scans: &[Scan]) -> (i64, [i64; 2]) {
    let looked_at = frames_to_look_at(scans.iter().map(|scan| scan.len() as u64));
    let times_ns = || looked_at.iter().filter_map(|&k| scans.get(k)).flat_map(|scan| &scan.time_offsets_ns);
    let (Some(first), Some(last)) = (times_ns().min(), times_ns().max()) else { return (0, [0; 2]) };
    ((0.5 * (*first as f64 + *last as f64)).round() as i64, [*first, *last])
}

impl ScanLog for MemoryLog {
    fn summary(&self) -> &LogSummary {
        &self.summary
    }

    fn static_frames(&self) -> &StaticFrames {
        &self.static_frames
    }

    fn frames(&self) -> &[FrameInfo] {
        &self.frames
    }

    fn number_in_log(&self, frame: usize) -> usize {
        self.scans.get(frame).map_or(frame, |(number, _)| *number)
    }

    fn scans_in_log(&self) -> usize {
        self.scans_in_log
    }

    fn reader(&self) -> Result<Box<dyn ScanReader + '_>, LogError> {
        Ok(Box::new(MemoryReader { scans: &self.scans, path: &self.summary.path }))
    }

    /// Each by itself: nothing is read any more.
    fn groups(&self) -> Vec<Range<usize>> {
        (0..self.scans.len()).map(|frame| frame..frame + 1).collect()
    }
}

/// Copies scans of a [`MemoryLog`].
struct MemoryReader<'a> {
    scans: &'a [(usize, Scan)],
    path: &'a Path,
}

impl ScanReader for MemoryReader<'_> {
    fn read(&mut self, frame: usize, scan: &mut Scan) -> Result<(), LogError> {
        let (_, held) = of_frame(self.scans, frame, self.path)?;
        scan.clone_from(held);
        Ok(())
    }
}
