//! What the targets have in common: bytes in a file, and everything read from it that can be.

use dmp_log::{
    LogError, LogOptions, PointTime, PoseTopic, ScanLog, open_log, outline_log, read_cloud, read_mesh,
    read_topic_trajectory, survey_log,
};
use dmp_sensor::Scan;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// A folder that is there as long as the process, on a file system in memory where there is one.
#[derive(Debug)]
pub struct Folder(TempDir);

impl Default for Folder {
    fn default() -> Self {
        let memory = Path::new("/dev/shm");
        let folder = if memory.is_dir() { TempDir::new_in(memory) } else { TempDir::new() };
        Self(folder.expect("a folder for the file that is read"))
    }
}

impl Folder {
    /// Puts a file into the folder.
    pub fn put(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.0.path().join(name);
        fs::write(&path, bytes).expect("a file that can be written");
        path
    }

    pub fn path(&self) -> &Path {
        self.0.path()
    }
}

/// Reads every scan of a log, with its times and without, and every second one by the log's index.
pub fn read_log(path: &Path, options: &LogOptions) {
    let _ = survey_log(path, options);
    for point_time in [PointTime::Auto, PointTime::Ignore] {
        let options = LogOptions { point_time, ..options.clone() };
        if let Ok(log) = open_log(path, &options) {
            read_scans(&*log);
        }
        let Ok(outline) = outline_log(path, &options) else { continue };
        let second: Vec<usize> = (0..outline.scans().len()).step_by(2).collect();
        if let Ok(part) = outline.open(&second) {
            read_scans(&*part);
        }
    }
}

fn read_scans(log: &dyn ScanLog) {
    let mut reader = log.reader().expect("a reader of what was opened");
    let mut scan = Scan::default();
    for frame in 0..log.frames().len() {
        if reader.read(frame, &mut scan).is_ok() {
            assert_eq!(scan.len() as u64, log.frames()[frame].returns);
        }
    }
}

/// Reads the poses of a bag's topics by the names they mostly have.
pub fn read_poses(path: &Path) {
    for topic in [None, Some("/odom"), Some("/pose"), Some("/path"), Some("/tf")] {
        let wanted = PoseTopic { topic: topic.map(str::to_owned), ..PoseTopic::default() };
        let _ = read_topic_trajectory(path, &wanted, Some("lidar"));
    }
}

/// Reads the points of a map.
pub fn read_points(path: &Path) {
    let mut points = 0;
    let read = read_cloud(path, None, |batch| {
        points += batch.len() as u64;
        Ok::<(), LogError>(())
    });
    assert!(read.is_err() || read.is_ok_and(|summary| summary.points == points));
}

/// Reads the triangles of a mesh.
pub fn read_triangles(path: &Path) {
    let mut triangles = 0;
    let read = read_mesh(path, |batch| {
        triangles += batch.len() as u64;
        Ok::<(), LogError>(())
    });
    assert!(read.is_err() || read.is_ok_and(|summary| summary.triangles == triangles));
}

/// A target whose bytes are put into a file of a folder and read by an expression of the file's path.
#[macro_export]
macro_rules! file_target {
    ($name:expr, |$path:ident| $read:expr) => {
        #[allow(unused_imports, reason = "not every target needs all of them")]
        use dmp_fuzz::*;
        thread_local!(static FOLDER: $crate::Folder = $crate::Folder::default());
        libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
            FOLDER.with(|folder| {
                let $path = folder.put($name, bytes);
                let $path = $path.as_path();
                $read;
            });
        });
    };
}
