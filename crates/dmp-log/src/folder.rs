//! Scan logs as a folder of KITTI `.bin` files.

use crate::decimal::seconds_to_ns;
use crate::log::{period_ns, runs_of_eight, span_ns};
use crate::open::files_with_extension;
use crate::points::{Origin, PointTime, RawTime, TimeRule, TimeUnit};
use crate::text::lines;
use crate::{
    Damage, FieldInfo, FieldMeaning, FrameInfo, LogError, LogFormat, LogOptions, LogSummary, Place, ScanLog,
    ScanReader, fingerprint,
};
use dmp_sensor::Scan;
use std::fs::{self, File};
use std::io::Read;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Bytes of a point: float32 x, y, z, intensity.
const POINT_BYTES: u64 = 16;
/// Where in a folder the scans may be.
const PLACES: [&str; 4] = ["", "scans", "velodyne", "velodyne_points/data"];

/// A folder of scans, one file each.
#[derive(Debug)]
pub(crate) struct BinFolder {
    files: Vec<ScanFile>,
    frames: Vec<FrameInfo>,
    time: Option<TimeRule>,
    summary: LogSummary,
}

#[derive(Debug)]
struct ScanFile {
    path: PathBuf,
    points: u64,
    /// The file with a time for each point.
    times: Option<PathBuf>,
}

impl BinFolder {
    /// The scans in or under `path`; `None` where there are none.
    pub(crate) fn open(path: &Path, options: &LogOptions) -> Result<Option<Self>, LogError> {
        for place in PLACES {
            let folder = if place.is_empty() { path.to_owned() } else { path.join(place) };
            if folder.is_dir() {
                let mut files = files_with_extension(&folder, "bin")?;
                if !files.is_empty() {
                    sort_by_number(&mut files);
                    return Self::of_files(&folder, files, options).map(Some);
                }
            }
        }
        Ok(None)
    }

    fn of_files(folder: &Path, paths: Vec<PathBuf>, options: &LogOptions) -> Result<Self, LogError> {
        if let Some(topic) = &options.topic {
            let problem = format!("--topic {topic} was given, but a folder of scans has no topics");
            return Err(LogError::Option { path: folder.into(), problem });
        }
        let mut notes = vec!["scans in the order of their file names".to_owned()];
        let (mut files, mut damage, mut names, mut bytes) = (Vec::new(), Vec::new(), Vec::new(), 0);
        for path in paths {
            let length = length_of(&path)?;
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            if !length.is_multiple_of(POINT_BYTES) {
                let whole = length / POINT_BYTES;
                let place = format!("{}, byte {}", path.display(), whole * POINT_BYTES);
                let what = format!(
                    "the file ends at byte {length}, within point {whole} of 16 bytes: the points before it are kept"
                );
                damage.push(Damage { place, what });
            }
            bytes += length;
            names.push((name, length));
            files.push(ScanFile { path, points: length / POINT_BYTES, times: None });
        }
        let stamps_ns = read_stamps(folder, files.len() as u64, &mut notes)?;
        let time = find_times(folder, &mut files, options.point_time, stamps_ns.is_some(), &mut notes)?;
        let frames: Vec<FrameInfo> = files
            .iter()
            .enumerate()
            .map(|(k, file)| FrameInfo {
                stamp_ns: stamps_ns.as_ref().and_then(|stamps| stamps.get(k).copied()),
                returns: file.points,
            })
            .collect();
        let field = |(name, offset_bytes): (&str, u32)| FieldInfo {
            name: name.into(),
            kind: "float32",
            offset_bytes,
            meaning: if offset_bytes < 12 { FieldMeaning::Coordinate } else { FieldMeaning::NotUsed },
        };
        let point_times = time.as_ref().map(|rule| format!("files times/*.f32: {}", rule.words()));
        let summary = LogSummary {
            path: folder.into(),
            format: LogFormat::BinFolder,
            topic: None,
            frame_id: None,
            fields: [("x", 0), ("y", 4), ("z", 8), ("intensity", 12)].map(field).into(),
            point_bytes: POINT_BYTES as u32,
            returns: frames.iter().map(|frame| frame.returns).sum(),
            span_ns: span_ns(&frames),
            period_ns: period_ns(&frames),
            point_times,
            notes,
            damage,
            fingerprint: fingerprint::of_names(names.iter().map(|(name, length)| (name.as_str(), *length))),
            bytes,
            topics: Vec::new(),
        };
        Ok(Self { files, frames, time, summary })
    }
}

/// Puts files that are all named by numbers in the order of the numbers, written with leading zeros or
/// without: by name alone, 10 comes before 2.
fn sort_by_number(files: &mut [PathBuf]) {
    let number = |file: &PathBuf| {
        let stem = file.file_stem()?.to_str()?.trim_start_matches('0').to_owned();
        stem.bytes().all(|c| c.is_ascii_digit()).then_some((stem.len(), stem))
    };
    if files.iter().all(|file| number(file).is_some()) {
        files.sort_by_cached_key(number);
    }
}

fn length_of(path: &Path) -> Result<u64, LogError> {
    Ok(fs::metadata(path).map_err(|e| LogError::io(path, "open", e))?.len())
}

/// Stamps from a `times.txt` beside the scans: seconds, one line a scan.
fn read_stamps(folder: &Path, scans: u64, notes: &mut Vec<String>) -> Result<Option<Vec<i64>>, LogError> {
    let found = beside(folder, "times.txt").into_iter().find(|path| path.is_file());
    let Some(path) = found else {
        notes.push("no times.txt: the scans have no stamps".into());
        return Ok(None);
    };
    let bytes = fs::read(&path).map_err(|e| LogError::io(&path, "read", e))?;
    let stamps_ns = parse_times(&bytes).map_err(|e| e.in_file(&path))?;
    if stamps_ns.len() as u64 != scans {
        return Err(LogError::CountMismatch {
            path,
            count: stamps_ns.len() as u64,
            what: "stamps",
            other: folder.into(),
            other_count: scans,
        });
    }
    notes.push(format!("stamps from {}", path.display()));
    Ok(Some(stamps_ns))
}

/// Stamps in nanoseconds from lines with one number of seconds each.
pub(crate) fn parse_times(bytes: &[u8]) -> Result<Vec<i64>, crate::ParseError> {
    let mut stamps_ns = Vec::new();
    for line in lines(bytes) {
        let (place, columns) = line?;
        let [seconds] = columns.as_slice() else {
            let problem = format!("{} columns, expected one number of seconds", columns.len());
            return Err(crate::ParseError::new(place, problem));
        };
        stamps_ns.push(seconds_to_ns(seconds).map_err(|problem| crate::ParseError::new(place, problem))?);
    }
    Ok(stamps_ns)
}

/// Finds the file with the times of each scan's points; how they are understood.
fn find_times(
    folder: &Path,
    files: &mut [ScanFile],
    point_time: PointTime,
    stamped: bool,
    notes: &mut Vec<String>,
) -> Result<Option<TimeRule>, LogError> {
    let Some(times) = beside(folder, "times").into_iter().find(|path| path.is_dir()) else {
        if TimeRule::given(point_time).is_none() {
            return Ok(None);
        }
        let problem =
            format!("--point-time {point_time} was given, but there is no folder times/ beside the scans");
        return Err(LogError::Option { path: folder.into(), problem });
    };
    if point_time == PointTime::Ignore {
        notes.push(format!("{}: not used, as was asked", times.display()));
        return Ok(None);
    }
    let rule = TimeRule::given(point_time).unwrap_or(TimeRule::new(TimeUnit::Seconds, Origin::Stamp));
    if rule.origin == Origin::Clock && !stamped {
        let problem =
            format!("--point-time {point_time} needs stamps of the scans, and there is no times.txt");
        return Err(LogError::Option { path: folder.into(), problem });
    }
    for file in files {
        let path = times.join(file.path.with_extension("f32").file_name().unwrap_or_default());
        let count = length_of(&path)? / 4;
        let cut = !length_of(&file.path)?.is_multiple_of(POINT_BYTES);
        // A cut scan has fewer points than times; the first ones belong together.
        if count != file.points && !(cut && count > file.points) {
            let (other, other_count) = (file.path.clone(), file.points);
            return Err(LogError::CountMismatch { path, count, what: "times", other, other_count });
        }
        file.times = Some(path);
    }
    notes.push(format!("a time for each point from {}", times.display()));
    Ok(Some(rule))
}

/// Where a companion of the scans may be: in their folder, or beside it.
fn beside(folder: &Path, name: &str) -> Vec<PathBuf> {
    let parent = folder.parent().map(|parent| parent.join(name));
    std::iter::once(folder.join(name)).chain(parent).collect()
}

impl ScanLog for BinFolder {
    fn summary(&self) -> &LogSummary {
        &self.summary
    }

    fn frames(&self) -> &[FrameInfo] {
        &self.frames
    }

    fn reader(&self) -> Result<Box<dyn ScanReader + '_>, LogError> {
        Ok(Box::new(BinReader { log: self, bytes: Vec::new() }))
    }

    fn groups(&self) -> Vec<Range<usize>> {
        runs_of_eight(self.files.len())
    }
}

/// Reads scans of a [`BinFolder`].
#[derive(Debug)]
struct BinReader<'a> {
    log: &'a BinFolder,
    bytes: Vec<u8>,
}

impl BinReader<'_> {
    /// Reads the first `count` bytes, which were there when the log was opened.
    fn fill(&mut self, path: &Path, count: u64) -> Result<(), LogError> {
        self.bytes.clear();
        let file = File::open(path).map_err(|e| LogError::io(path, "open", e))?;
        file.take(count).read_to_end(&mut self.bytes).map_err(|e| LogError::io(path, "read", e))?;
        if self.bytes.len() as u64 != count {
            let problem = format!("the file had {count} bytes when it was opened and is shorter now");
            return Err(LogError::malformed(path, Place::Byte(self.bytes.len() as u64), problem));
        }
        Ok(())
    }
}

impl ScanReader for BinReader<'_> {
    fn read(&mut self, frame: usize, scan: &mut Scan) -> Result<(), LogError> {
        scan.clear();
        let log = self.log;
        let (Some(file), Some(info)) = (log.files.get(frame), log.frames.get(frame)) else {
            let problem = format!("the log has {} scans", log.files.len());
            return Err(LogError::malformed(&log.summary.path, Place::Frame(frame as u64), problem));
        };
        scan.stamp_ns = info.stamp_ns;
        self.fill(&file.path, file.points * POINT_BYTES)?;
        let (words, _) = self.bytes.as_chunks::<4>();
        let points = words.chunks_exact(4).filter_map(|point| point.first_chunk::<3>());
        scan.points_in_sensor_m.extend(points.map(|xyz| xyz.map(f32::from_le_bytes)));
        let (Some(times), Some(rule)) = (&file.times, log.time) else { return Ok(()) };
        self.fill(times, file.points * 4)?;
        let (words, _) = self.bytes.as_chunks::<4>();
        for (word, point) in words.iter().zip(&mut scan.points_in_sensor_m) {
            let raw = RawTime::Float(f32::from_le_bytes(*word).into());
            let offset_ns = rule.offset_ns(raw, info.stamp_ns.unwrap_or(0), None);
            if offset_ns.is_none() {
                *point = [f32::NAN; 3];
            }
            scan.time_offsets_ns.push(offset_ns.unwrap_or(0));
        }
        Ok(())
    }
}
