//! Output files of the command.

use std::fs::{File, TryLockError};
use std::io::{BufWriter, Write as _};
use std::path::Path;

use anyhow::{Context as _, bail};
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
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let prefix = format!(".{}.", name.to_string_lossy());
    let mut builder = tempfile::Builder::new();
    builder.prefix(&prefix).suffix(".tmp");
    // As any other output file: others may read it, as far as the user's mask lets them.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    // A name of its own, removed unless it is kept: nothing of another program, or of a killed one, is touched.
    let written = builder.tempfile_in(folder).and_then(|temporary| {
        let mut out = BufWriter::new(temporary.as_file().try_clone()?);
        write(&mut out)?;
        out.flush()?;
        out.get_ref().sync_all()?;
        drop(out);
        temporary.persist(path).map(drop).map_err(|refused| refused.error)
    });
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

/// Takes a folder for the outputs of this process alone, until the answer is dropped or the process ends in
/// whatever way. Nothing is left in the folder by it.
pub(crate) fn take_folder(folder: &Path) -> anyhow::Result<Option<File>> {
    // Where a folder cannot be opened or locked, two programs at once are the user's to avoid.
    let Ok(handle) = File::open(folder) else { return Ok(None) };
    match handle.try_lock() {
        Ok(()) => Ok(Some(handle)),
        Err(TryLockError::WouldBlock) => {
            bail!("{}: another dmp is saving here: wait for it, or name another folder", folder.display())
        }
        Err(TryLockError::Error(_)) => Ok(None),
    }
}
