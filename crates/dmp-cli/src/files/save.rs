//! Output files of the command.

use std::fs::{self, File, TryLockError};
use std::io::{self, BufWriter, Write};
use std::path::Path;

use anyhow::{Context as _, Error, bail};
use dmp_disk::{OutputFile, Unfinished, place_of};
use dmp_log::{write_kitti, write_tum};
use dmp_sensor::Trajectory;

use super::clash::refuse_clashes;
use crate::console::Usage;

/// Writes a trajectory: in TUM format where it has stamps, as KITTI rows where it has none.
pub(crate) fn save_trajectory(path: &Path, trajectory: &Trajectory) -> anyhow::Result<()> {
    save(path, |out| write_trajectory(out, trajectory))
}

/// The text of such a file.
pub(crate) fn write_trajectory(out: &mut impl Write, trajectory: &Trajectory) -> io::Result<()> {
    match trajectory.stamps_ns() {
        Some(_) => write_tum(out, trajectory),
        None => write_kitti(out, trajectory),
    }
}

/// Writes a text file.
pub(crate) fn save_text(path: &Path, text: &str) -> anyhow::Result<()> {
    save(path, |out| out.write_all(text.as_bytes()))
}

/// Writes a file that is there whole or not at all.
pub(crate) fn save(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> anyhow::Result<()> {
    let written = written(path, write).and_then(OutputFile::commit);
    written.with_context(|| format!("{}: cannot write", path.display()))
}

/// A file that has all but its name.
fn written(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> io::Result<OutputFile> {
    let output = OutputFile::create(path)?;
    let mut out = BufWriter::new(output.file()?);
    write(&mut out)?;
    out.flush()?;
    Ok(output)
}

/// Files that belong together: none is there before all are whole.
#[derive(Debug, Default)]
pub(crate) struct SavedTogether(Vec<OutputFile>);

impl SavedTogether {
    /// Writes one more.
    pub(crate) fn add(
        &mut self,
        path: &Path,
        write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
    ) -> anyhow::Result<()> {
        let written = written(path, write).with_context(|| format!("{}: cannot write", path.display()))?;
        self.0.push(written);
        Ok(())
    }

    /// Writes one more that the user has not named: what is there already stays, unless it is the very same, as a process
    /// leaves it that is killed between two names.
    pub(crate) fn add_unnamed(
        &mut self,
        path: &Path,
        write: impl FnOnce(&mut Vec<u8>) -> io::Result<()>,
    ) -> anyhow::Result<()> {
        let mut bytes = Vec::new();
        write(&mut bytes).with_context(|| path.display().to_string())?;
        refuse_other(path, &bytes)?;
        self.add(path, |out| out.write_all(&bytes))
    }

    /// Gives all of them their names.
    pub(crate) fn commit(self) -> anyhow::Result<()> {
        let targets: Vec<&Path> = self.0.iter().map(OutputFile::target).collect();
        let none: [&Path; 0] = [];
        refuse_clashes(&targets, &none)?;
        OutputFile::commit_all(self.0)
            .map_err(|(path, error)| Error::new(error).context(format!("{}: cannot write", path.display())))
    }
}

/// Refuses to replace a file that the user has not named by another one.
pub(crate) fn refuse_other(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    let is_as_long = |found: fs::Metadata| found.is_file() && found.len() == bytes.len() as u64;
    let is_same =
        fs::metadata(path).is_ok_and(is_as_long) && fs::read(path).is_ok_and(|there| there == bytes);
    if is_same { Ok(()) } else { refuse_unnamed(path) }
}

/// Refuses to replace a file that the user has not named.
pub(crate) fn refuse_unnamed(path: &Path) -> anyhow::Result<()> {
    match fs::symlink_metadata(path) {
        // A device or a pipe takes as much as one likes.
        Ok(found) if found.is_file() || found.is_symlink() || found.is_dir() => {
            let problem = "is there already and would be overwritten: move it, or write elsewhere";
            bail!(Usage(format!("{}: {problem}", path.display())))
        }
        Err(error) if error.kind() != io::ErrorKind::NotFound => {
            Err(error).with_context(|| path.display().to_string())
        }
        _ => Ok(()),
    }
}

/// Whether a path is that of a file, or of nothing yet: a place with a folder of its own.
pub(crate) fn may_be_file(path: &Path) -> bool {
    !matches!(place_of(path), Ok(None)) && fs::metadata(path).map_or(true, |found| found.is_file())
}

/// Whether there is surely nothing at a path: what cannot be looked at is opened, and that says why it cannot.
pub(crate) fn is_missing(path: &Path) -> bool {
    matches!(path.try_exists(), Ok(false))
}

/// A folder for outputs; one that is new goes again where nothing was put into it.
#[derive(Debug)]
pub(crate) struct OutputsFolder {
    /// Those that are new, it and what it lies in, outer ones first.
    made: Vec<Unfinished>,
    taken: Option<File>,
}

impl OutputsFolder {
    /// Makes it if need be.
    pub(crate) fn make(folder: &Path) -> anyhow::Result<Self> {
        let mut outputs = Self { made: Vec::new(), taken: None };
        let made = outputs.make_missing(folder);
        made.with_context(|| format!("{}: cannot make the folder", folder.display()))?;
        Ok(outputs)
    }

    fn make_missing(&mut self, folder: &Path) -> io::Result<()> {
        // What cannot be looked at is assumed to exist: it is not removed.
        let is_missing = |path: &&Path| !path.as_os_str().is_empty() && is_missing(path);
        let missing: Vec<&Path> = folder.ancestors().take_while(is_missing).collect();
        for path in missing.into_iter().rev() {
            match Unfinished::make_folder(path) {
                Ok(made) => self.made.push(made),
                // Another process made it meanwhile, or its name leads back.
                Err(_) if path.is_dir() => {}
                Err(error) => return Err(error),
            }
        }
        // Says what is wrong with what is there and no folder, or with looking at it.
        match fs::create_dir_all(folder) {
            Err(error) if !fs::metadata(folder)?.is_dir() => Err(error),
            _ => Ok(()),
        }
    }

    /// Makes it if need be, and takes it for this process alone.
    pub(crate) fn take(folder: &Path) -> anyhow::Result<Self> {
        let mut outputs = Self::make(folder)?;
        outputs.taken = take_folder(folder)?;
        Ok(outputs)
    }
}

impl Drop for OutputsFolder {
    fn drop(&mut self) {
        // It stays where there is anything in it.
        for made in self.made.drain(..).rev() {
            let _ = fs::remove_dir(made.path());
        }
        drop(self.taken.take());
    }
}

/// Takes a folder for the outputs of this process alone, until the answer is dropped or the process ends. Nothing is left in the folder by it.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_new_folder_stays_where_there_is_something_in_it() {
        let parent = tempfile::tempdir().unwrap();
        let [empty, full, old] = ["new/er/empty", "full", "old"].map(|name| parent.path().join(name));
        fs::create_dir(&old).unwrap();
        for folder in [&empty, &full, &old] {
            let _made = OutputsFolder::take(folder).unwrap();
            assert!(OutputsFolder::take(folder).is_err(), "it is one process's at a time");
            if *folder == full {
                fs::write(folder.join("a.dmpmap"), b"map").unwrap();
            }
        }
        assert!(!parent.path().join("new").exists() && full.exists() && old.exists());
    }
}
