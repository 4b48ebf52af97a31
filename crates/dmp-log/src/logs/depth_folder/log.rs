//! The images of a folder as a log: the pixels of each are the returns of a scan.

use super::camera::{self, CameraFile};
use super::found::{FoundImage, FoundImages};
use super::image::{DecodingProblem, read_head, read_values};
use crate::file::{CountedFile, DamageList, KnownFile, ReadCount, fingerprint, first_in_words};
use crate::scans::of_frame;
use crate::{
    Damage, FieldInfo, FieldMeaning, FrameInfo, LogError, LogIndex, LogOptions, LogSetting, LogSummary,
    PlaceInFile, PointTime, ScanLog, ScanReader, StampAt, shown_path,
};
use dmp_sensor::{PixelBearings, Scan};
use std::io::{BufReader, Seek};
use std::path::Path;

/// A folder of depth images, each a scan.
#[derive(Debug)]
pub(crate) struct DepthFolder {
    entries: Vec<Entry>,
    frames: Vec<FrameInfo>,
    size_px: [u32; 2],
    bearings: PixelBearings,
    units_per_m: f64,
    summary: LogSummary,
    /// How it was opened.
    options: LogOptions,
    count: ReadCount,
}

/// An image whose head is well.
#[derive(Debug)]
struct Entry {
    file: KnownFile,
    stamp_ns: Option<i64>,
}

#[derive(Debug, Default)]
struct Stock {
    entries: Vec<Entry>,
    /// Of the first image, and so of all.
    size_px: Option<[u32; 2]>,
    damage: DamageList,
    bytes: u64,
    names: Vec<(String, u64)>,
}

impl DepthFolder {
    pub(crate) fn open(found: FoundImages, options: &LogOptions) -> Result<Self, LogError> {
        let FoundImages { folder, layout, images, camera_file, mut notes } = found;
        check_options(&folder, options)?;
        let count = ReadCount::default();
        let file = camera_file.map(CameraFile::read).transpose()?;
        let mut stock = Stock { size_px: file.as_ref().map(|file| file.size_px), ..Stock::default() };
        for image in images {
            stock.take(image, &count)?;
        }
        let Stock { entries, size_px, damage, bytes, mut names } = stock;
        let damage = damage.into_vec();
        let Some(size_px) = size_px.filter(|_| !entries.is_empty()) else {
            let problem = format!("no depth image can be read{}", first_in_words(&damage));
            return Err(LogError::malformed(&folder, PlaceInFile::WholeFile, problem));
        };
        let (camera, units_per_m) = camera::choose(&folder, layout, size_px, file.as_ref(), &mut notes)?;
        // What the images mean depends on the camera as well.
        names.push((format!("{camera:?}, {units_per_m} units a metre"), 0));
        let info = |entry: &Entry| FrameInfo {
            stamp_ns: entry.stamp_ns,
            returns: u64::from(size_px[0]) * u64::from(size_px[1]),
        };
        let frames: Vec<FrameInfo> = entries.iter().map(info).collect();
        let mut summary = LogSummary {
            fields: vec![FieldInfo::new("depth", "uint16", 0, FieldMeaning::Coordinate)],
            point_bytes: 2,
            camera: Some(camera),
            depth_units_per_m: Some(units_per_m),
            are_depth_units_guessed: file.as_ref().is_none_or(|file| file.units_per_m.is_none()),
            notes,
            damage,
            fingerprint: fingerprint::of_names(names.iter().map(|(name, length)| (name.as_str(), *length))),
            bytes,
            ..LogSummary::of(&folder, layout.usual().format)
        };
        summary.describe(&frames);
        Ok(Self {
            entries,
            frames,
            size_px,
            bearings: camera.bearings(),
            units_per_m,
            summary,
            options: options.clone(),
            count,
        })
    }

    /// Bytes of the file of each frame.
    pub(crate) fn scan_bytes(&self) -> Vec<u64> {
        self.entries.iter().map(|entry| entry.file.length).collect()
    }

    /// Reads the values of an image, pairs of bytes, the larger first.
    fn values_of(&self, entry: &Entry, values: &mut Vec<u8>) -> Result<(), LogError> {
        let path = &entry.file.path;
        let (file, known) = open(path, &self.count)?;
        if known != entry.file {
            return Err(known.changed_since(&entry.file));
        }
        let mut input = BufReader::new(file);
        read_values(&mut input, self.size_px, values).map_err(|problem| match problem {
            DecodingProblem::Io(error) => LogError::io(path, "read", error),
            DecodingProblem::Damage(problem) => {
                let place = input.stream_position().map_or(PlaceInFile::WholeFile, PlaceInFile::Byte);
                LogError::malformed(path, place, problem)
            }
        })
    }
}

impl Stock {
    /// Takes an image in, or says why it is left out.
    fn take(&mut self, image: FoundImage, count: &ReadCount) -> Result<(), LogError> {
        let FoundImage { path, stamp_ns } = image;
        let lost = |what: String| Damage::new(shown_path(&path), format!("{what}; the image is skipped"));
        let (mut file, known) = match open(&path, count) {
            Ok(opened) => opened,
            Err(LogError::NotFound { .. }) => {
                self.damage.push(lost("no such file".into()));
                return Ok(());
            }
            Err(error) => return Err(error),
        };
        let length = known.length;
        self.bytes += length;
        self.names.push((path.file_name().unwrap_or_default().to_string_lossy().into_owned(), length));
        let head = read_head(&mut file, length).map_err(|e| LogError::io(&path, "read", e))?;
        match (head, self.size_px) {
            (Err(problem), _) => self.damage.push(lost(problem)),
            (Ok([width, height]), Some(others)) if [width, height] != others => {
                let [wide, high] = others;
                self.damage.push(lost(format!("{width} x {height} pixels, not {wide} x {high}")));
            }
            (Ok(size_px), _) => {
                self.size_px = Some(size_px);
                self.entries.push(Entry { file: known, stamp_ns });
            }
        }
        Ok(())
    }
}

/// Opens an image, which must be a file: a list may name anything.
fn open(path: &Path, count: &ReadCount) -> Result<(CountedFile, KnownFile), LogError> {
    let metadata = std::fs::metadata(path).map_err(|e| LogError::io(path, "open", e))?;
    if !metadata.is_file() {
        return Err(LogError::NotFound { path: path.into() });
    }
    let file = count.open(path).map_err(|e| LogError::io(path, "open", e))?;
    Ok((file, KnownFile::new(path, &metadata)))
}

/// Nothing that has no meaning for images.
fn check_options(folder: &Path, options: &LogOptions) -> Result<(), LogError> {
    let (setting, value, problem) = match options {
        LogOptions { topic: Some(topic), .. } => {
            (LogSetting::Topic, topic.clone(), "was given, but a folder of depth images has no topics")
        }
        LogOptions { point_time, .. } if !matches!(point_time, PointTime::Auto | PointTime::Ignore) => {
            let problem = "was given, but the pixels of a depth image have no times";
            (LogSetting::PointTime, point_time.to_string(), problem)
        }
        LogOptions { point_time_field: Some(field), .. } => {
            let problem = "was given, but the pixels of a depth image have no times";
            (LogSetting::PointTimeField, field.clone(), problem)
        }
        LogOptions { stamp_at, .. } if *stamp_at != StampAt::Start => {
            (LogSetting::StampAt, stamp_at.name().to_owned(), "was given, but a depth image is one instant")
        }
        _ => return Ok(()),
    };
    Err(LogError::setting(folder, setting, value, problem))
}

impl ScanLog for DepthFolder {
    fn summary(&self) -> &LogSummary {
        &self.summary
    }

    fn frames(&self) -> &[FrameInfo] {
        &self.frames
    }

    fn reader(&self) -> Result<Box<dyn ScanReader + '_>, LogError> {
        Ok(Box::new(DepthReader { log: self, values: Vec::new() }))
    }

    fn index(&self) -> Result<Option<LogIndex>, LogError> {
        Ok(Some(LogIndex::whole(&self.summary, &self.options)))
    }

    fn bytes_read(&self) -> Option<u64> {
        Some(self.count.bytes())
    }
}

#[derive(Debug)]
struct DepthReader<'a> {
    log: &'a DepthFolder,
    values: Vec<u8>,
}

impl ScanReader for DepthReader<'_> {
    fn read(&mut self, frame: usize, scan: &mut Scan) -> Result<(), LogError> {
        scan.clear();
        let log = self.log;
        let entry = of_frame(&log.entries, frame, &log.summary.path)?;
        scan.stamp_ns = entry.stamp_ns;
        log.values_of(entry, &mut self.values)?;
        let (values, _) = self.values.as_chunks::<2>();
        scan.points_in_sensor_m.extend(values.iter().enumerate().map(|(pixel, value)| {
            let depth_m = (f64::from(u16::from_be_bytes(*value)) / log.units_per_m) as f32;
            log.bearings.point(pixel, depth_m)
        }));
        Ok(())
    }
}
