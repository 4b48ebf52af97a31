//! The `metadata.yaml` of a rosbag2 folder.
#![no_main]

dmp_fuzz::file_target!("metadata.yaml", |path| {
    let folder = path.parent().expect("a folder");
    read_log(folder, &dmp_log::LogOptions::default())
});
