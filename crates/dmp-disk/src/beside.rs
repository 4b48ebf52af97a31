//! Things in the making: beside their targets, under names that nothing has.

use std::fs::{self, File, OpenOptions};
use std::io;
use std::path::Path;

use crate::Unfinished;
use crate::folder_lock::{is_at, open_lock};

/// Suffix of unfinished files: no other program uses it.
const SUFFIX: &str = ".dmp-tmp";
/// Bytes of the target's name in the name of its unfinished file: names are 255 bytes at most.
const NAME_BYTES: usize = 200;
/// Letters and digits between the two.
const RANDOM: usize = 6;

/// A file or folder beside its target, locked by this process; removed when it is dropped, unless it was renamed.
#[derive(Debug)]
pub(crate) struct Beside {
    unfinished: Unfinished,
    /// Held: by it others see that somebody is at work.
    lock: Option<File>,
    renamed: bool,
}

impl Beside {
    /// Makes it under a name that nothing has.
    fn make<T>(target: &Path, mut make: impl FnMut(&Path) -> io::Result<T>) -> io::Result<(Self, T)> {
        let mut builder = tempfile::Builder::new();
        let prefix = prefix(target);
        builder.prefix(&prefix).suffix(SUFFIX).rand_bytes(RANDOM);
        let (unfinished, made) = Unfinished::make(|| {
            let (made, path) = builder.make_in(folder_of(target), |path| make(path))?.into_parts();
            Ok::<_, io::Error>((path.keep().map_err(|error| error.error)?, made))
        })?;
        Ok((Self { unfinished, lock: None, renamed: false }, made))
    }

    /// A new file, as any other may read it.
    pub(crate) fn file(target: &Path) -> io::Result<(Self, File)> {
        sweep(target);
        loop {
            let open = |path: &Path| OpenOptions::new().read(true).write(true).create_new(true).open(path);
            let (mut beside, file) = Self::make(target, open)?;
            let lock = file.try_clone()?;
            if lock_new(&lock, beside.path())? {
                beside.lock = Some(lock);
                return Ok((beside, file));
            }
        }
    }

    /// A new folder.
    pub(crate) fn folder(target: &Path) -> io::Result<Self> {
        sweep(target);
        loop {
            let (mut beside, ()) = Self::make(target, |path| fs::create_dir(path))?;
            // Where folders cannot be opened they are not locked, and never swept.
            let Ok(lock) = File::open(beside.path()) else { return Ok(beside) };
            if lock_new(&lock, beside.path())? {
                beside.lock = Some(lock);
                return Ok(beside);
            }
        }
    }

    pub(crate) fn path(&self) -> &Path {
        self.unfinished.path()
    }

    /// Gives it the name of `target`.
    pub(crate) fn rename(&mut self, target: &Path) -> io::Result<()> {
        fs::rename(self.path(), target)?;
        self.renamed = true;
        Ok(())
    }
}

impl Drop for Beside {
    fn drop(&mut self) {
        if !self.renamed {
            // Nothing to report to, and a leftover is swept by the next one.
            let _ = fs::remove_file(self.path()).or_else(|_| fs::remove_dir_all(self.path()));
        }
        // Closing it would not do: a process that another thread starts just now holds a copy of it for a moment.
        let _ = self.lock.as_ref().map(File::unlock);
    }
}

/// Locks what was just made, where there are locks; false when another process took it for a leftover before.
fn lock_new(file: &File, path: &Path) -> io::Result<bool> {
    match file.try_lock() {
        Ok(()) => is_at(file, path),
        Err(fs::TryLockError::WouldBlock) => Ok(false),
        Err(fs::TryLockError::Error(_)) => Ok(true),
    }
}

/// Removes what killed processes left beside the target, in the making of it.
fn sweep(target: &Path) {
    let prefix = prefix(target);
    for entry in fs::read_dir(folder_of(target)).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let random = name.to_str().and_then(|name| name.strip_prefix(&prefix)?.strip_suffix(SUFFIX));
        let is_ours = random.is_some_and(|part| {
            part.len() == RANDOM && part.bytes().all(|byte| byte.is_ascii_alphanumeric())
        });
        let kind = entry.file_type().ok().filter(|kind| is_ours && (kind.is_file() || kind.is_dir()));
        let Some(kind) = kind else { continue };
        let opened = if kind.is_dir() { File::open(entry.path()) } else { open_lock(&entry.path(), false) };
        let Ok(file) = opened else { continue };
        if file.try_lock().is_ok() {
            let path = entry.path();
            let _ = if kind.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) };
        }
    }
}

fn prefix(target: &Path) -> String {
    let name = target.file_name().unwrap_or_default().to_string_lossy();
    format!(".{}.", &name[..name.floor_char_boundary(NAME_BYTES)])
}

/// The folder that a file lies in.
pub fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Brings the name of a file to disk, where folders can be opened and synced.
pub(crate) fn flush_folder(of: &Path) -> io::Result<()> {
    if !cfg!(unix) {
        return Ok(());
    }
    match File::open(folder_of(of)).and_then(|folder| folder.sync_all()) {
        // A folder that may be written and not read, a file system that has nothing to sync of a folder.
        Err(error)
            if matches!(
                error.kind(),
                io::ErrorKind::PermissionDenied | io::ErrorKind::InvalidInput | io::ErrorKind::Unsupported
            ) =>
        {
            Ok(())
        }
        flushed => flushed,
    }
}
