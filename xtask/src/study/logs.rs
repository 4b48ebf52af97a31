//! The log of a drive, written once for all studies.

use std::path::Path;

use anyhow::Context as _;
use dmp_log::{LogOptions, McapScanWriter, McapWriterOptions, MemoryLog, ScanLog, open_log};
use dmp_sensor::{Scan, Trajectory};
use dmp_sim::Recording;

use super::drives::DriveSpec;

/// Writes the drive's scans, unless the file exists.
pub(super) fn write_log(recording: &Recording<'_>, path: &Path) -> anyhow::Result<()> {
    if !path.exists() {
        // Under another name until it is complete.
        let partial = path.with_extension("partial");
        let mut log = McapScanWriter::create(&partial, &McapWriterOptions::default())?;
        for scan in recording.scans() {
            log.write_scan(&scan)?;
        }
        log.finish()?;
        std::fs::rename(&partial, path).with_context(|| path.display().to_string())?;
    }
    Ok(())
}

/// The log of a drive with its truth.
pub(super) struct DriveLog {
    pub(super) log: Box<dyn ScanLog>,
    pub(super) truth: Trajectory,
    /// The truth at 100 Hz: odometries stamp their poses within the sweep.
    pub(super) fine: Trajectory,
}

impl DriveLog {
    /// Opens the log in the folder `work`; writes it first where it is missing.
    pub(super) fn open(spec: &DriveSpec, work: &Path) -> anyhow::Result<Self> {
        std::fs::create_dir_all(work).with_context(|| work.display().to_string())?;
        let town = spec.town()?;
        let recording = Recording::new(&town, &spec.options)?;
        let path = work.join(format!("{}.mcap", spec.name));
        write_log(&recording, &path)?;
        Ok(Self {
            log: open_log(&path, &LogOptions::default())?,
            truth: spec.truth(&recording)?,
            fine: recording.drive().trajectory(100.0)?,
        })
    }

    /// The log of every so many of its scans.
    pub(super) fn with_every(self, every: usize) -> anyhow::Result<Self> {
        if every == 1 {
            return Ok(self);
        }
        let mut reader = self.log.reader()?;
        let read = |frame: usize| {
            let mut scan = Scan::default();
            reader.read(frame, &mut scan)?;
            anyhow::Ok(scan)
        };
        let scans = (0..self.log.frames().len()).step_by(every).map(read).collect::<anyhow::Result<_>>()?;
        drop(reader);
        let log = Box::new(MemoryLog::new("every", scans)?);
        Ok(Self { log, ..self })
    }
}
