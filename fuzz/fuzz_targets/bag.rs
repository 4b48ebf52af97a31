//! MCAP files: scans and poses.
#![no_main]

dmp_fuzz::file_target!("log.mcap", |path| {
    read_log(path, &dmp_log::LogOptions::default());
    read_poses(path)
});
