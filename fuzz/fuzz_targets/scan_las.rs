//! A folder of LAS or LAZ scans.
#![no_main]

dmp_fuzz::file_target!("000000.laz", |path| {
    let folder = path.parent().expect("a folder");
    read_log(folder, &dmp_log::LogOptions::default())
});
