use std::path::Path;

/// What a file system has left for whoever asks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FreeSpace {
    /// Bytes that can still be written.
    pub bytes: u64,
    /// The same for all folders of the file system.
    pub file_system: u64,
}

/// The room on the file system that a folder is on; `None` where the system does not tell.
#[cfg(unix)]
pub fn free_space(folder: &Path) -> Option<FreeSpace> {
    use std::os::unix::fs::MetadataExt as _;
    let found = rustix::fs::statvfs(folder).ok()?;
    let file_system = std::fs::metadata(folder).ok()?.dev();
    Some(FreeSpace { bytes: found.f_bavail.saturating_mul(found.f_frsize), file_system })
}

/// The room on the file system that a folder is on; `None` where the system does not tell.
#[cfg(not(unix))]
pub fn free_space(_: &Path) -> Option<FreeSpace> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_of_one_file_system_share_its_room() {
        let folder = tempfile::tempdir().unwrap();
        let inside = folder.path().join("inside");
        std::fs::create_dir(&inside).unwrap();
        assert_eq!(free_space(&folder.path().join("not-there")), None);
        let [outer, inner] = [folder.path(), &inside].map(free_space);
        assert_eq!(outer.is_some(), cfg!(unix));
        if let (Some(outer), Some(inner)) = (outer, inner) {
            assert_eq!(outer.file_system, inner.file_system);
            assert!(outer.bytes > 0);
        }
    }
}
