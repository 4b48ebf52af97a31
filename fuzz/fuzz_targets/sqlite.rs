//! rosbag2's `.db3` files: scans and poses.
#![no_main]

dmp_fuzz::file_target!("log.db3", |path| {
    read_log(path, &dmp_log::LogOptions::default());
    read_poses(path)
});
