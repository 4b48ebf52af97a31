//! A folder of `.bin` scans.
#![no_main]

dmp_fuzz::file_target!("000000.bin", |path| {
    let folder = path.parent().expect("a folder");
    read_log(folder, &dmp_log::LogOptions::default())
});
