//! Where a path leads.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use crate::beside::folder_of;
use crate::folder_lock::may_follow;

/// How many links are followed, as Linux does.
const LINKS: usize = 40;

/// The end of all links.
enum End {
    /// What is there, or what is not there yet.
    Name(PathBuf),
    /// An open file of a process.
    Open(PathBuf),
}

fn end_of(path: &Path) -> io::Result<End> {
    let mut path = path.to_path_buf();
    for _ in 0..LINKS {
        if path.starts_with("/proc") || path.starts_with("/dev/fd") {
            return Ok(End::Open(path));
        }
        match fs::read_link(&path) {
            Ok(_) if !may_follow(&path, folder_of(&path)) => {
                return Err(io::Error::new(io::ErrorKind::PermissionDenied, "it is another user's link"));
            }
            Ok(to) => path = folder_of(&path).join(to),
            // No link, or nothing.
            Err(error) if matches!(error.kind(), io::ErrorKind::InvalidInput | io::ErrorKind::NotFound) => {
                return Ok(End::Name(path));
            }
            Err(error) => return Err(error),
        }
    }
    Err(io::Error::other("too many links, each to the next"))
}

/// What a path leads to over all links, whether it is there or not; `None` where that is an open file of a process.
pub(crate) fn resolved(path: &Path) -> io::Result<Option<PathBuf>> {
    Ok(match end_of(path)? {
        End::Name(path) => Some(path),
        End::Open(_) => None,
    })
}

/// The place of what is written to a path, by whatever links and names, whether it is there or not: two paths with one place
/// are one file. `None` where it is an open file of a process, such as `/dev/stdout`.
///
/// # Errors
/// When a link cannot be followed.
pub fn place_of(path: &Path) -> io::Result<Option<PathBuf>> {
    Ok(resolved(path)?.map(|path| from_root(&path)))
}

/// A path without links and steps back, as far as its folders are there.
fn from_root(path: &Path) -> PathBuf {
    if let Ok(found) = path.canonicalize() {
        return found;
    }
    match path.file_name() {
        Some(name) => from_root(folder_of(path)).join(name),
        None if path.ends_with("..") => {
            let folder = from_root(folder_of(path));
            folder.parent().map_or(folder.clone(), Path::to_path_buf)
        }
        None => path.to_path_buf(),
    }
}

/// Whether a path is that of standard output, as `/dev/stdout` is.
pub fn is_stdout(path: &Path) -> bool {
    let is_first = |path: &Path| path == Path::new("/proc/self/fd/1") || path == Path::new("/dev/fd/1");
    matches!(end_of(path), Ok(End::Open(path)) if is_first(&path))
}

/// Opens what is no regular file to write to it. Standard output is open already: opened anew, a file behind it would be
/// written from another place than the one that it is at.
pub(crate) fn open_through(path: &Path) -> io::Result<File> {
    #[cfg(unix)]
    if is_stdout(path) {
        use std::os::fd::AsFd as _;
        return Ok(io::stdout().as_fd().try_clone_to_owned()?.into());
    }
    File::options().append(true).open(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn one_place_has_many_names() {
        use std::os::unix::fs::symlink;
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        symlink("not-yet", path("link")).unwrap();
        fs::create_dir(path("sub")).unwrap();
        symlink("sub", path("also")).unwrap();
        let same = |a: &str, b: &str| place_of(&path(a)).unwrap() == place_of(&path(b)).unwrap();
        assert!(
            same("link", "not-yet") && same("also/x", "sub/./x") && same("new/er/x", "new/../new/er/./x")
        );
        assert!(!same("link", "sub/not-yet") && !same("new/x", "newer/x"));
        assert!(place_of(Path::new("no-folder.csv")).unwrap().unwrap().is_absolute());
        symlink("/dev/stdout", path("printed")).unwrap();
        for name in ["/dev/stdout", "/dev/fd/1", path("printed").to_str().unwrap()] {
            assert!(place_of(Path::new(name)).unwrap().is_none() && is_stdout(Path::new(name)), "{name}");
        }
        assert!(!is_stdout(Path::new("/dev/stderr")) && !is_stdout(&path("link")));
    }
}
