//! Writing scans as a folder of files with one scan each.

mod las;
mod rows;

use crate::LogError;
use crate::file::ns_to_seconds;
use dmp_disk::OutputFolder;
use dmp_sensor::Scan;
use std::fmt::Write as _;
use std::fs::{self, File};
use std::io::{ErrorKind, Write as _};
use std::path::Path;

/// How the scans of a folder are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum FolderFormat {
    /// KITTI: float32 x, y, z and an intensity of 0; times of points in `times/NNNNNN.f32`, float32 seconds
    /// after the stamp.
    Bin,
    /// PCD with binary data: float32 x, y, z; times of points in a field `t`, uint32 nanoseconds after the
    /// stamp.
    Pcd,
    /// PLY, little-endian, with the same fields.
    Ply,
    /// LAZ 1.4 with points of format 6: coordinates to 0.1 mm; times of points in `gps_time`, seconds after the
    /// stamp. It has no NaN: a return that is not finite is written as 0, 0, 0, which is none.
    Laz,
    /// The same without compression.
    Las,
}

impl FolderFormat {
    /// The extension of the files, without a full stop.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Bin => "bin",
            Self::Pcd => "pcd",
            Self::Ply => "ply",
            Self::Laz => "laz",
            Self::Las => "las",
        }
    }

    /// What is lost of a scan, in words; `None` where nothing is.
    pub fn precision(self) -> Option<&'static str> {
        match self {
            Self::Bin => Some("times of points as float32 seconds, to 4 ns of 0.1 s"),
            Self::Laz | Self::Las => Some("coordinates to 0.1 mm"),
            Self::Pcd | Self::Ply => None,
        }
    }
}

/// Writes scans as a folder: `scans/NNNNNN.EXT` with a scan each, and `times.txt` (seconds, where scans have
/// stamps). The same scans give the same bytes. The folder gets its name in [`FolderScanWriter::finish`];
/// without it nothing is left behind.
///
/// ```
/// use dmp_log::{FolderFormat, FolderScanWriter, LogOptions, open_log};
/// use dmp_sensor::Scan;
///
/// # let folder = tempfile::tempdir()?;
/// # let path = folder.path().join("drive");
/// let mut writer = FolderScanWriter::create(&path, FolderFormat::Pcd)?;
/// for k in 0..3 {
///     let points_in_sensor_m = vec![[4.0, 3.0, 0.5]; 10];
///     writer.write_scan(&Scan { stamp_ns: Some(k * 100_000_000), points_in_sensor_m, time_offsets_ns: vec![] })?;
/// }
/// writer.finish()?;
/// assert_eq!(open_log(&path, &LogOptions::default())?.frames()[2].stamp_ns, Some(200_000_000));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct FolderScanWriter {
    output: OutputFolder,
    format: FolderFormat,
    frames: u64,
    stamped: Option<bool>,
    timed: Option<bool>,
    stamps: String,
    bytes: Vec<u8>,
}

impl FolderScanWriter {
    /// Starts a log that will be the folder `path`, where there must be nothing yet.
    ///
    /// # Errors
    /// When there is something, and when the folder cannot be created.
    pub fn create(path: &Path, format: FolderFormat) -> Result<Self, LogError> {
        let output = new_output(path)?;
        create_folder(&output.path().join("scans"))?;
        let (stamps, bytes) = (String::new(), Vec::new());
        Ok(Self { output, format, frames: 0, stamped: None, timed: None, stamps, bytes })
    }

    /// Appends a scan.
    ///
    /// # Errors
    /// When the scan has a stamp or times and those before had none, or the other way round; when its times
    /// or places are beyond what the format can say; and when the disk is full.
    pub fn write_scan(&mut self, scan: &Scan) -> Result<(), LogError> {
        self.check(scan)?;
        let name = format!("{:06}", self.frames);
        let timed = self.timed == Some(true);
        self.bytes.clear();
        match self.format {
            FolderFormat::Bin => rows::bin(scan, &mut self.bytes),
            FolderFormat::Pcd => rows::pcd(scan, timed, &mut self.bytes),
            FolderFormat::Ply => rows::ply(scan, timed, &mut self.bytes),
            FolderFormat::Laz | FolderFormat::Las => {
                let written = las::write(scan, self.format == FolderFormat::Laz, &mut self.bytes);
                written.map_err(|problem| self.unwritable(problem))?;
            }
        }
        let file = format!("{name}.{}", self.format.extension());
        write_file(&self.output.path().join("scans").join(file), &self.bytes)?;
        if timed && self.format == FolderFormat::Bin {
            self.bytes.clear();
            for &offset_ns in &scan.time_offsets_ns {
                self.bytes.extend_from_slice(&((offset_ns as f64 / 1e9) as f32).to_le_bytes());
            }
            write_file(&self.output.path().join("times").join(format!("{name}.f32")), &self.bytes)?;
        }
        if let Some(stamp_ns) = scan.stamp_ns {
            // Writing to a string cannot fail.
            let _ = writeln!(self.stamps, "{}", ns_to_seconds(stamp_ns));
        }
        self.frames += 1;
        Ok(())
    }

    /// Writes the stamps and gives the folder its name.
    ///
    /// # Errors
    /// When the disk is full or the folder cannot be renamed.
    pub fn finish(self) -> Result<(), LogError> {
        if self.stamped == Some(true) {
            write_file(&self.output.path().join("times.txt"), self.stamps.as_bytes())?;
        }
        commit(self.output)
    }

    fn check(&mut self, scan: &Scan) -> Result<(), LogError> {
        let (points, times, stamped) = (scan.len(), scan.time_offsets_ns.len(), scan.stamp_ns.is_some());
        let timed = if points == 0 { self.timed } else { Some(times > 0) };
        let problem = if times != 0 && times != points {
            format!("{points} points and {times} times")
        } else if self.stamped.is_some_and(|before| before != stamped) {
            format!("its stamp is {:?}, unlike those before it", scan.stamp_ns)
        } else if self.timed.is_some() && self.timed != timed {
            format!("it has {times} times for {points} points, unlike those before it")
        } else if let Some(beyond) = self.beyond_32_bits(scan) {
            format!("a point {beyond} ns after the stamp is beyond 32 bits")
        } else {
            let in_files = self.format == FolderFormat::Bin;
            if in_files && self.timed.is_none() && timed == Some(true) {
                self.begin_times()?;
            }
            (self.stamped, self.timed) = (Some(stamped), timed);
            return Ok(());
        };
        Err(self.unwritable(problem))
    }

    fn unwritable(&self, problem: String) -> LogError {
        LogError::Unwritable { path: self.output.target().into(), frame: self.frames, problem }
    }

    /// The first time that does not fit in a `t` of uint32, where there is such a field.
    fn beyond_32_bits(&self, scan: &Scan) -> Option<i64> {
        let has_field = matches!(self.format, FolderFormat::Pcd | FolderFormat::Ply);
        let times = scan.time_offsets_ns.iter().filter(|_| has_field);
        times.copied().find(|&offset_ns| u32::try_from(offset_ns).is_err())
    }

    /// The first scan with times: the empty ones before it get empty files.
    fn begin_times(&self) -> Result<(), LogError> {
        let folder = self.output.path().join("times");
        create_folder(&folder)?;
        (0..self.frames).try_for_each(|frame| write_file(&folder.join(format!("{frame:06}.f32")), &[]))
    }
}

/// A folder that will be `path`, where there must be nothing yet.
pub(crate) fn new_output(path: &Path) -> Result<OutputFolder, LogError> {
    OutputFolder::create(path).map_err(|error| match error.kind() {
        ErrorKind::AlreadyExists | ErrorKind::InvalidInput => {
            LogError::Option { path: path.into(), problem: error.to_string() }
        }
        _ => LogError::io(path, "create", error),
    })
}

/// Gives what is whole its name.
pub(crate) fn commit(output: OutputFolder) -> Result<(), LogError> {
    let target = output.target().to_path_buf();
    output.commit().map_err(|error| LogError::io(&target, "rename to", error))
}

pub(crate) fn create_folder(path: &Path) -> Result<(), LogError> {
    fs::create_dir(path).map_err(|e| LogError::io(path, "create", e))
}

pub(crate) fn write_file(path: &Path, bytes: &[u8]) -> Result<(), LogError> {
    let write = || {
        let mut file = File::create(path)?;
        file.write_all(bytes)?;
        file.sync_all()
    };
    write().map_err(|e| LogError::io(path, "write", e))
}
