//! Output files of the command.

use std::fs::{self, File};
use std::io::{BufWriter, Write as _};
use std::path::Path;

use anyhow::Context as _;
use dmp_log::{write_kitti, write_tum};
use dmp_sensor::Trajectory;

use crate::exit::Usage;

/// Writes a trajectory: in TUM format where it has stamps, as KITTI rows where it has none.
pub(crate) fn save_trajectory(path: &Path, trajectory: &Trajectory) -> anyhow::Result<()> {
    save(path, |out| match trajectory.stamps_ns() {
        Some(_) => write_tum(out, trajectory),
        None => write_kitti(out, trajectory),
    })
}

/// Writes a text file.
pub(crate) fn save_text(path: &Path, text: &str) -> anyhow::Result<()> {
    save(path, |out| out.write_all(text.as_bytes()))
}

/// Writes a file that is there whole or not at all: under a temporary name first.
pub(crate) fn save(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> std::io::Result<()>,
) -> anyhow::Result<()> {
    let name = path.file_name().with_context(|| format!("{}: not the name of a file", path.display()))?;
    let temporary = path.with_file_name(format!(".{}.{}.tmp", name.to_string_lossy(), std::process::id()));
    let written = File::create(&temporary).and_then(|file| {
        let mut out = BufWriter::new(file);
        write(&mut out)?;
        out.flush()?;
        out.get_ref().sync_all()?;
        fs::rename(&temporary, path)
    });
    if written.is_err() {
        // It may never have been created; the first error is the one to tell.
        let _ = fs::remove_file(&temporary);
    }
    written.with_context(|| format!("{}: cannot write", path.display()))
}

/// Refuses an output that is its own input.
pub(crate) fn refuse_same(input: &Path, output: &Path) -> Result<(), Usage> {
    if same_file(input, output) {
        return Err(Usage(format!("{}: the output would take the place of the input", output.display())));
    }
    Ok(())
}

/// Whether two paths lead to one file that exists.
fn same_file(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}
