use crate::LogError;
use crate::atomic::Pending;
use crate::decimal::ns_to_seconds;
use dmp_sensor::Scan;
use std::fmt::Write as _;
use std::fs::{self, File};
use std::io::Write as _;
use std::path::Path;

/// Writes scans as a folder: `scans/NNNNNN.bin` (float32 x, y, z and an intensity of 0), `times.txt`
/// (seconds, where scans have stamps) and `times/NNNNNN.f32` (float32 seconds after the stamp, where
/// points have times). The same scans give the same bytes. The folder gets its name in
/// [`BinFolderWriter::finish`]; without it nothing is left behind.
#[derive(Debug)]
pub struct BinFolderWriter {
    pending: Pending,
    frames: u64,
    stamped: Option<bool>,
    timed: Option<bool>,
    stamps: String,
    bytes: Vec<u8>,
}

impl BinFolderWriter {
    /// Starts a log that will be the folder `path`, where there must be nothing yet.
    ///
    /// # Errors
    /// When there is something, and when the folder cannot be created.
    pub fn create(path: &Path) -> Result<Self, LogError> {
        let pending = Pending::folder(path)?;
        create_folder(&pending.path().join("scans"))?;
        let bytes = Vec::new();
        Ok(Self { pending, frames: 0, stamped: None, timed: None, stamps: String::new(), bytes })
    }

    /// Appends a scan.
    ///
    /// # Errors
    /// When the scan has a stamp or times and those before had none, or the other way round; and when
    /// the disk is full.
    pub fn write_scan(&mut self, scan: &Scan) -> Result<(), LogError> {
        self.check(scan)?;
        let name = format!("{:06}", self.frames);
        self.bytes.clear();
        for point in &scan.points_in_sensor_m {
            self.bytes.extend_from_slice(point.map(f32::to_le_bytes).as_flattened());
            self.bytes.extend_from_slice(&0_f32.to_le_bytes());
        }
        write_file(&self.pending.path().join("scans").join(format!("{name}.bin")), &self.bytes)?;
        if self.timed == Some(true) {
            self.bytes.clear();
            for &offset_ns in &scan.time_offsets_ns {
                self.bytes.extend_from_slice(&((offset_ns as f64 / 1e9) as f32).to_le_bytes());
            }
            write_file(&self.pending.path().join("times").join(format!("{name}.f32")), &self.bytes)?;
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
            write_file(&self.pending.path().join("times.txt"), self.stamps.as_bytes())?;
        }
        self.pending.commit()
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
        } else {
            if self.timed.is_none() && timed == Some(true) {
                self.begin_times()?;
            }
            (self.stamped, self.timed) = (Some(stamped), timed);
            return Ok(());
        };
        Err(LogError::Unwritable { path: self.pending.target().into(), frame: self.frames, problem })
    }

    /// The first scan with times: the empty ones before it get empty files.
    fn begin_times(&self) -> Result<(), LogError> {
        let folder = self.pending.path().join("times");
        create_folder(&folder)?;
        (0..self.frames).try_for_each(|frame| write_file(&folder.join(format!("{frame:06}.f32")), &[]))
    }
}

fn create_folder(path: &Path) -> Result<(), LogError> {
    fs::create_dir(path).map_err(|e| LogError::io(path, "create", e))
}

fn write_file(path: &Path, bytes: &[u8]) -> Result<(), LogError> {
    let write = || {
        let mut file = File::create(path)?;
        file.write_all(bytes)?;
        file.sync_all()
    };
    write().map_err(|e| LogError::io(path, "write", e))
}
