//! The log of a drive, written once for all studies of it.

use std::path::{Path, PathBuf};

use anyhow::Context as _;
use dmp::Run;
use dmp_log::{LogOptions, McapScanWriter, McapWriterOptions, ScanLog, open_log};
use dmp_sensor::Trajectory;
use dmp_sim::Recording;

use super::drives::DriveSpec;
use super::estimates::estimates;

/// Writes the drive's scans, unless they lie there already.
pub(super) fn write_log(recording: &Recording<'_>, path: &Path) -> anyhow::Result<()> {
    if !path.exists() {
        // Under another name until it is whole.
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

/// The log of a drive, written where it is not there yet, and its estimates.
pub(super) fn log_and_runs(spec: &DriveSpec, work: &Path) -> anyhow::Result<(PathBuf, Vec<Run>)> {
    let town = spec.town()?;
    let recording = Recording::new(&town, &spec.options)?;
    let path = work.join(format!("{}.mcap", spec.name));
    write_log(&recording, &path)?;
    let estimates = estimates(spec, &spec.truth(&recording)?)?;
    Ok((path, estimates.into_iter().map(|e| Run::new(e.name, e.trajectory)).collect()))
}

/// The log of a drive, written where it is not there yet, and its truth.
pub(super) fn log_and_truth(spec: &DriveSpec, work: &Path) -> anyhow::Result<(Box<dyn ScanLog>, Trajectory)> {
    let town = spec.town()?;
    let recording = Recording::new(&town, &spec.options)?;
    let path = work.join(format!("{}.mcap", spec.name));
    write_log(&recording, &path)?;
    Ok((open_log(&path, &LogOptions::default())?, spec.truth(&recording)?))
}
