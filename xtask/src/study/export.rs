//! A drive as files.

use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::Path;

use anyhow::{Context as _, ensure};
use dmp_log::{FolderFormat, FolderScanWriter, write_tum};
use dmp_sim::Recording;

use super::drives::DriveSpec;

/// Writes a drive as a folder of scans, and its truth beside it.
pub(super) fn export(spec: &DriveSpec, folder: &Path) -> anyhow::Result<()> {
    let town = spec.town()?;
    let recording = Recording::new(&town, &spec.options)?;
    let mut writer = FolderScanWriter::create(folder, FolderFormat::Bin)?;
    let mut returns = 0;
    for scan in recording.scans() {
        returns += scan.len();
        writer.write_scan(&scan)?;
    }
    writer.finish()?;
    ensure!(returns > 0, "{}: nothing came back", spec.name);
    let truth = folder.with_extension("truth.tum");
    let mut out = BufWriter::new(File::create(&truth).with_context(|| format!("{}", truth.display()))?);
    write_tum(&mut out, &spec.truth(&recording)?)?;
    out.flush()?;
    println!("{}: {} scans, {returns} returns", folder.display(), recording.len());
    Ok(())
}
