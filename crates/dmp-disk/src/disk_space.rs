//! How much can still be written to a file system.

use std::path::Path;

/// Free space of a file system.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DiskSpace {
    /// Bytes that can still be written.
    pub free_bytes: u64,
    /// Its number: the same for all folders on it.
    pub file_system: u64,
}

/// What is free on the file system that a folder is on; `None` where the system does not say.
#[cfg(unix)]
pub fn disk_space(folder: &Path) -> Option<DiskSpace> {
    use std::os::unix::fs::MetadataExt as _;
    let found = rustix::fs::statvfs(folder).ok()?;
    let file_system = std::fs::metadata(folder).ok()?.dev();
    Some(DiskSpace { free_bytes: found.f_bavail.saturating_mul(found.f_frsize), file_system })
}

/// What is free on the file system that a folder is on; `None` where the system does not say.
#[cfg(not(unix))]
pub fn disk_space(_: &Path) -> Option<DiskSpace> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_of_one_file_system_share_its_space() {
        let folder = tempfile::tempdir().unwrap();
        let inside = folder.path().join("inside");
        std::fs::create_dir(&inside).unwrap();
        assert_eq!(disk_space(&folder.path().join("not-there")), None);
        let [outer, inner] = [folder.path(), &inside].map(disk_space);
        assert_eq!(outer.is_some(), cfg!(unix));
        if let (Some(outer), Some(inner)) = (outer, inner) {
            assert_eq!(outer.file_system, inner.file_system);
            assert!(outer.free_bytes > 0);
        }
    }
}
