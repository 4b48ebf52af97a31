//! Files of the user's that appear whole or not at all.

use std::fs::{self, File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};

use crate::beside::{Beside, flush_folder};
use crate::folder_lock::there;
use crate::place::{open_through, resolved};
use crate::unfinished;

/// A file under a name of its own beside its target; it takes the target's place when it is whole, and is removed otherwise.
///
/// - A link is followed, and stays: what it leads to is replaced. What is replaced keeps its permissions.
/// - What is no regular file (`/dev/null`, `/dev/stdout`, a pipe) is not replaced: all is written through to it once it is
///   whole.
/// - What a killed process left beside the target is removed by the next one that writes there.
///
/// ```
/// use std::io::Write as _;
/// use dmp_disk::OutputFile;
///
/// let folder = tempfile::tempdir()?;
/// let path = folder.path().join("scores.json");
/// let output = OutputFile::create(&path)?;
/// output.file()?.write_all(b"{}")?;
/// assert!(!path.exists());
/// output.commit()?;
/// assert_eq!(std::fs::read(&path)?, b"{}");
/// # Ok::<(), std::io::Error>(())
/// ```
#[derive(Debug)]
pub struct OutputFile {
    file: File,
    target: PathBuf,
    place: Place,
}

#[derive(Debug)]
enum Place {
    /// Renamed over what `PathBuf` names, which is no link.
    Beside(Beside, PathBuf),
    /// Copied into what the target is.
    Through,
}

impl OutputFile {
    /// A new file that will be `target`.
    ///
    /// # Errors
    /// When nothing can be written beside the target; when the target is there and is a folder or must not be written.
    pub fn create(target: &Path) -> io::Result<Self> {
        let there = there(fs::metadata(target))?;
        if target.file_name().is_none() || there.as_ref().is_some_and(fs::Metadata::is_dir) {
            return Err(io::Error::new(io::ErrorKind::IsADirectory, "it is not the name of a file"));
        }
        let place = resolved(target)?;
        let is_file = there.as_ref().is_none_or(fs::Metadata::is_file);
        let Some(place) = place.filter(|_| is_file) else {
            return Ok(Self { file: tempfile::tempfile()?, target: target.into(), place: Place::Through });
        };
        if there.is_some() {
            // A file that must not be written is not replaced either.
            OpenOptions::new().write(true).open(&place)?;
        }
        let (beside, file) = Beside::file(&place)?;
        if let Some(there) = there {
            keep_rights(&file, &there);
        }
        Ok(Self { file, target: target.into(), place: Place::Beside(beside, place) })
    }

    /// To write to, from where it was written to last.
    ///
    /// # Errors
    /// When the system has no more handles.
    pub fn file(&self) -> io::Result<File> {
        self.file.try_clone()
    }

    /// What it will be.
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// Brings it to disk and gives it its name.
    ///
    /// # Errors
    /// When that cannot be done; what was there before is then untouched, but where it is no regular file, or where all went
    /// well but to bring the new name to disk.
    pub fn commit(self) -> io::Result<()> {
        let Place::Beside(_, place) = &self.place else { return self.commit_unsynced() };
        let place = place.clone();
        self.file.sync_all()?;
        self.commit_unsynced()?;
        flush_folder(&place)
    }

    /// Gives it its name, for what need not outlive a loss of power.
    ///
    /// # Errors
    /// As [`Self::commit`].
    pub fn commit_unsynced(mut self) -> io::Result<()> {
        match self.place {
            Place::Beside(mut beside, place) => beside.rename(&place)?,
            Place::Through => {
                io::Seek::rewind(&mut self.file)?;
                io::copy(&mut self.file, &mut open_through(&self.target)?)?;
            }
        }
        Ok(())
    }

    /// Brings several to disk and then gives all of them their names; a request to end does not come between those.
    ///
    /// # Errors
    /// As [`Self::commit`], with the target; where the first name cannot be given, none is.
    pub fn commit_all(mut files: Vec<Self>) -> Result<(), (PathBuf, io::Error)> {
        let failed = |target: &Path| {
            let target = target.to_path_buf();
            move |error| (target, error)
        };
        for file in &files {
            file.file.sync_all().map_err(failed(&file.target))?;
        }
        {
            let _held = unfinished::all();
            for file in &mut files {
                if let Place::Beside(beside, place) = &mut file.place {
                    beside.rename(place).map_err(failed(&file.target))?;
                }
            }
        }
        for file in files {
            let failed = failed(&file.target);
            match &file.place {
                Place::Beside(_, place) => flush_folder(place).map_err(failed)?,
                Place::Through => file.commit().map_err(failed)?,
            }
        }
        Ok(())
    }

    /// Gives a whole file that was made elsewhere on the same file system the place of `target`.
    ///
    /// # Errors
    /// As [`Self::create`] and [`Self::commit`].
    pub fn give_place(made: &Path, target: &Path) -> io::Result<()> {
        let output = Self::create(target)?;
        match &output.place {
            Place::Beside(_, place) => {
                let file = File::open(made)?;
                if let Some(there) = there(fs::metadata(place))? {
                    keep_rights(&file, &there);
                }
                file.sync_all()?;
                fs::rename(made, place)?;
                flush_folder(place)
            }
            Place::Through => {
                io::copy(&mut File::open(made)?, &mut output.file()?)?;
                output.commit()
            }
        }
    }
}

/// Gives a new file the owner and permissions of the one that it replaces, as far as the user may.
fn keep_rights(file: &File, there: &fs::Metadata) {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt as _;
        let (uid, gid) = (rustix::fs::Uid::from_raw(there.uid()), rustix::fs::Gid::from_raw(there.gid()));
        // A member of the group may give it to the group, though not to the owner.
        let _ = rustix::fs::fchown(file, None, Some(gid));
        let _ = rustix::fs::fchown(file, Some(uid), None);
    }
    let _ = file.set_permissions(there.permissions());
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{Read as _, Write as _};

    fn write(target: &Path, bytes: &[u8]) -> io::Result<()> {
        let output = OutputFile::create(target)?;
        output.file()?.write_all(bytes)?;
        output.commit()
    }

    #[test]
    fn what_is_not_committed_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.json");
        fs::write(&path, b"before").unwrap();
        let output = OutputFile::create(&path).unwrap();
        output.file().unwrap().write_all(b"half").unwrap();
        drop(output);
        assert_eq!(fs::read(&path).unwrap(), b"before");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        assert!(write(folder.path(), b"x").is_err() && write(&folder.path().join(".."), b"x").is_err());
    }

    #[test]
    fn leftovers_are_swept_and_files_in_the_making_are_not() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.json");
        let left = folder.path().join(".a.json.Ab3xYz.dmp-tmp");
        let other = folder.path().join(".b.json.Ab3xYz.dmp-tmp");
        fs::write(&left, b"half").unwrap();
        fs::write(&other, b"half").unwrap();
        let in_the_making = OutputFile::create(&path).unwrap();
        write(&path, b"whole").unwrap();
        assert!(!left.exists() && other.exists());
        in_the_making.file().unwrap().write_all(b"later").unwrap();
        in_the_making.commit().unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"later");
        // A name as long as names may be.
        let long = folder.path().join("n".repeat(255));
        write(&long, b"long").unwrap();
        assert_eq!(fs::read(&long).unwrap(), b"long");
    }

    #[test]
    fn several_get_their_names_together() {
        let folder = tempfile::tempdir().unwrap();
        let paths = ["a", "b"].map(|name| folder.path().join(name));
        let files: Vec<OutputFile> = paths.iter().map(|path| OutputFile::create(path).unwrap()).collect();
        files.iter().for_each(|file| file.file().unwrap().write_all(b"whole").unwrap());
        assert!(!paths[0].exists());
        OutputFile::commit_all(files).unwrap();
        assert!(paths.iter().all(|path| fs::read(path).unwrap() == b"whole"));
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
    }

    #[cfg(unix)]
    #[test]
    fn links_stay_and_rights_are_kept() {
        use std::os::unix::fs::{PermissionsExt as _, symlink};
        let folder = tempfile::tempdir().unwrap();
        let [there, link, to_nowhere, nowhere] =
            ["there", "link", "to-nowhere", "nowhere"].map(|name| folder.path().join(name));
        fs::write(&there, b"before").unwrap();
        fs::set_permissions(&there, fs::Permissions::from_mode(0o640)).unwrap();
        symlink("there", &link).unwrap();
        symlink("nowhere", &to_nowhere).unwrap();
        write(&link, b"after").unwrap();
        write(&to_nowhere, b"new").unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read(&there).unwrap(), b"after");
        assert_eq!(fs::metadata(&there).unwrap().permissions().mode() & 0o777, 0o640);
        assert_eq!(fs::read(&nowhere).unwrap(), b"new");
        let made = folder.path().join("made");
        fs::write(&made, b"elsewhere").unwrap();
        OutputFile::give_place(&made, &link).unwrap();
        assert!(!made.exists() && fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::metadata(&there).unwrap().permissions().mode() & 0o777, 0o640);
        symlink("loop", folder.path().join("loop")).unwrap();
        assert!(write(&folder.path().join("loop"), b"x").is_err());
    }

    #[cfg(unix)]
    #[test]
    fn what_is_no_file_is_written_through() {
        use std::os::unix::fs::FileTypeExt as _;
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        let reader = std::thread::spawn({
            let pipe = pipe.clone();
            move || {
                let mut read = Vec::new();
                File::open(pipe).unwrap().read_to_end(&mut read).unwrap();
                read
            }
        });
        write(&pipe, b"through").unwrap();
        assert_eq!(reader.join().unwrap(), b"through");
        assert!(fs::metadata(&pipe).unwrap().file_type().is_fifo());
        write(Path::new("/dev/null"), b"gone").unwrap();
        assert!(fs::metadata("/dev/null").unwrap().file_type().is_char_device());
    }
}
