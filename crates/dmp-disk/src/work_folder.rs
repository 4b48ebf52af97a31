//! Where the files of one evaluation live, and what is kept of it for another process.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use crate::folder_lock::{LOCK, lock_folder};
use crate::left_behind::{PREFIX, has_checkpoint, is_checkpoint, own_folders, remove, sweep};
use crate::{DiskError, Unfinished};

/// Random letters and digits.
const RANDOM: usize = 12;
/// How often a folder is made anew where others remove it before it is locked.
const TRIES: u32 = 20;

/// Where scratch files, maps and checkpoints of one evaluation live: a folder that one process at a time works in.
///
/// It is removed with all it holds when it is dropped, unless it [stays](Self::keep). A process that is
/// killed leaves it behind: with a checkpoint in it, it can be [resumed](Self::of); without one, the next
/// process that makes a folder beside it removes it.
///
/// ```
/// use dmp_disk::WorkFolder;
///
/// let parent = tempfile::tempdir()?;
/// let mut folder = WorkFolder::of(parent.path(), "town", false)?;
/// folder.save("fusing", b"as far as scan 1200")?;
/// folder.keep();
/// drop(folder);
/// // Another process resumes from there.
/// let folder = WorkFolder::of(parent.path(), "town", true)?;
/// assert_eq!(folder.load("fusing")?.as_deref(), Some(&b"as far as scan 1200"[..]));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct WorkFolder {
    path: PathBuf,
    /// Locked until this is dropped.
    lock: File,
    kept: bool,
    _unfinished: Unfinished,
}

impl WorkFolder {
    /// Makes a folder inside `parent`, with a random name, that no other user may look into.
    ///
    /// # Errors
    /// When it cannot be made there.
    pub fn new(parent: &Path) -> Result<Self, DiskError> {
        sweep(parent);
        Self::make(parent, PREFIX)
    }

    /// The folder inside `parent` that belongs to `id`: empty, or, with `resume`, as it was left. One that is another
    /// user's, or that others may write in, is not looked at.
    ///
    /// # Errors
    /// When it cannot be made or emptied there, or another process works in it.
    pub fn of(parent: &Path, id: &str, resume: bool) -> Result<Self, DiskError> {
        sweep(parent);
        let prefix = format!("{PREFIX}{id}-");
        let mut left: Vec<PathBuf> = own_folders(parent, &prefix).collect();
        // Those with a checkpoint first.
        left.sort_by_key(|path| (!has_checkpoint(path), path.clone()));
        // The parent is to be there: a path that was mistyped is no place for gigabytes.
        let Some(path) = left.into_iter().next() else { return Self::make(parent, &prefix) };
        // Until it is locked it may be another process's.
        let lock = lock_folder(&path)?;
        let folder = Self { _unfinished: Unfinished::new(&path), path, lock, kept: false };
        if !resume {
            folder.clear()?;
        }
        Ok(folder)
    }

    fn make(parent: &Path, prefix: &str) -> Result<Self, DiskError> {
        let mut tries = 1;
        loop {
            let mut builder = tempfile::Builder::new();
            builder.prefix(prefix).rand_bytes(RANDOM);
            #[cfg(unix)]
            builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o700));
            let made = Unfinished::make(|| Ok((builder.tempdir_in(parent)?.keep(), ())));
            let (unfinished, ()) = made.map_err(DiskError::io(parent, "cannot make a work folder here"))?;
            let path = unfinished.path().to_owned();
            match lock_folder(&path) {
                Ok(lock) => return Ok(Self { path, lock, kept: false, _unfinished: unfinished }),
                Err(error) => {
                    // Before it had its lock, another process may have taken it for one that was left behind.
                    let swept = matches!(error, DiskError::Locked { .. }) || !path.exists();
                    let _ = fs::remove_dir_all(&path);
                    if !swept || tries == TRIES {
                        return Err(error);
                    }
                    tries += 1;
                }
            }
        }
    }

    fn clear(&self) -> Result<(), DiskError> {
        let emptied = || -> io::Result<()> {
            let entries = fs::read_dir(&self.path)?.map(|entry| Ok(entry?.path()));
            let mut left: Vec<PathBuf> = entries.collect::<io::Result<_>>()?;
            left.retain(|path| !path.ends_with(LOCK));
            // The checkpoint first: where this ends midway, nothing resumes from the rest.
            left.sort_by_key(|path| !is_checkpoint(path));
            left.iter().try_for_each(fs::remove_file)
        };
        emptied().map_err(DiskError::io(&self.path, "cannot empty the work folder"))
    }

    /// The folder.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// A file in it.
    pub fn file(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    /// Leaves the folder as it is when this is dropped.
    pub fn keep(&mut self) {
        self.kept = true;
    }

    /// Brings a file of the folder to disk.
    ///
    /// # Errors
    /// When that cannot be done.
    pub fn sync(&self, file: &Path) -> Result<(), DiskError> {
        let io = |what| DiskError::io(file, what);
        File::open(file).and_then(|file| file.sync_all()).map_err(io("cannot write it to disk"))
    }

    /// Removes the files whose names end in `.extension`.
    pub fn remove_files(&self, extension: &str) {
        for entry in fs::read_dir(&self.path).into_iter().flatten().flatten() {
            if entry.path().extension().is_some_and(|found| found == extension) {
                // What cannot be removed now goes with the folder.
                let _ = fs::remove_file(entry.path());
            }
        }
    }

    /// Whether anything is kept.
    pub fn has_checkpoint(&self) -> bool {
        has_checkpoint(&self.path)
    }
}

impl Drop for WorkFolder {
    fn drop(&mut self) {
        if !self.kept {
            remove(&self.path);
        }
        // Closing it would not do: a process that another thread starts just now holds a copy of it for a moment.
        let _ = self.lock.unlock();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_goes_with_its_owner_unless_it_is_to_stay() {
        let parent = tempfile::tempdir().unwrap();
        let path = WorkFolder::new(parent.path()).unwrap().path().to_owned();
        assert!(!path.exists());
        let mut work = WorkFolder::of(parent.path(), "a", false).unwrap();
        fs::write(work.file("map"), b"surfels").unwrap();
        work.save("fuse", b"half").unwrap();
        assert!(matches!(WorkFolder::of(parent.path(), "a", true), Err(DiskError::Locked { .. })));
        work.keep();
        drop(work);
        let resumed = WorkFolder::of(parent.path(), "a", true).unwrap();
        assert_eq!(resumed.load("fuse").unwrap().as_deref(), Some(&b"half"[..]));
        assert!(resumed.load("cast").unwrap().is_none() && resumed.file("map").exists());
        resumed.forget("fuse");
        assert!(!resumed.has_checkpoint());
        drop(resumed);
        let mut afresh = WorkFolder::of(parent.path(), "a", false).unwrap();
        assert!(!afresh.file("map").exists());
        afresh.keep();
        let left = afresh.path().to_owned();
        drop(afresh);
        // Not in use and without a checkpoint: the next one cleans up.
        drop(WorkFolder::new(parent.path()).unwrap());
        assert!(!left.exists());
    }

    /// What a process that is being started by another thread does to the lock: it has a copy of it for a moment.
    #[test]
    fn a_copy_of_its_lock_does_not_keep_a_folder_taken() {
        let parent = tempfile::tempdir().unwrap();
        let mut work = WorkFolder::of(parent.path(), "a", false).unwrap();
        let copy = work.lock.try_clone().unwrap();
        work.save("fuse", b"half").unwrap();
        work.keep();
        drop(work);
        assert!(WorkFolder::of(parent.path(), "a", true).unwrap().holds("fuse"));
        drop(copy);
    }

    #[test]
    fn folders_in_use_or_with_a_checkpoint_are_left_alone() {
        let parent = tempfile::tempdir().unwrap();
        let in_use = WorkFolder::new(parent.path()).unwrap();
        let mut kept = WorkFolder::of(parent.path(), "b", false).unwrap();
        kept.save("cast", b"sums").unwrap();
        kept.keep();
        let path = kept.path().to_owned();
        drop(kept);
        drop(WorkFolder::new(parent.path()).unwrap());
        assert!(in_use.path().exists() && path.exists());
    }

    /// What others put where everybody may write: links to a user's files, pipes to wait at, folders of theirs.
    #[cfg(unix)]
    #[test]
    fn what_others_put_there_is_not_touched() {
        use std::os::unix::fs::{PermissionsExt as _, symlink};
        let parent = tempfile::tempdir().unwrap();
        let others = tempfile::tempdir().unwrap();
        fs::write(others.path().join("lock"), b"foreign").unwrap();
        symlink(others.path(), parent.path().join("dmp-work-a-linked")).unwrap();
        let pipe = parent.path().join("dmp-work-a-pipe");
        fs::create_dir(&pipe).unwrap();
        let made = std::process::Command::new("mkfifo").arg(pipe.join("lock")).status().unwrap();
        assert!(made.success());
        let open = parent.path().join("dmp-work-a-open");
        fs::create_dir(&open).unwrap();
        fs::set_permissions(&open, fs::Permissions::from_mode(0o777)).unwrap();
        fs::write(open.join("cast.checkpoint"), b"forged").unwrap();
        // The pipe's folder is this user's: an error, without blocking.
        assert!(WorkFolder::of(parent.path(), "a", true).is_err());
        fs::remove_dir_all(&pipe).unwrap();
        let work = WorkFolder::of(parent.path(), "a", true).unwrap();
        assert!(![others.path(), &open].contains(&work.path()) && !work.has_checkpoint());
        assert_eq!(fs::metadata(work.path()).unwrap().permissions().mode() & 0o777, 0o700);
        drop(work);
        drop(WorkFolder::new(parent.path()).unwrap());
        assert_eq!(fs::read(others.path().join("lock")).unwrap(), b"foreign");
        assert!(open.join("cast.checkpoint").exists());
    }

    /// A folder is there before it is locked; a sweep at that moment must not remove it.
    #[test]
    fn folders_made_at_the_same_time_are_all_there() {
        let parent = tempfile::tempdir().unwrap();
        std::thread::scope(|scope| {
            for _ in 0..8 {
                scope.spawn(|| {
                    for _ in 0..100 {
                        let work = WorkFolder::new(parent.path()).unwrap();
                        fs::write(work.file("map"), b"surfels").unwrap();
                        work.save("fuse", b"half").unwrap();
                        assert_eq!(work.load("fuse").unwrap().as_deref(), Some(&b"half"[..]));
                    }
                });
            }
        });
        assert_eq!(fs::read_dir(parent.path()).unwrap().count(), 0);
    }
}
