//! The stamps beside a folder of scans, in both kinds of lines, and those of a trajectory.
#![no_main]

use libfuzzer_sys::fuzz_target;

thread_local!(static FOLDER: dmp_fuzz::Folder = {
    let folder = dmp_fuzz::Folder::default();
    folder.put("0.bin", &[0; 64]);
    folder.put("1.bin", &[0; 64]);
    folder.put("run.txt", "1 0 0 5 0 1 0 6 0 0 1 7\n".repeat(2).as_bytes());
    folder
});

fuzz_target!(|bytes: &[u8]| {
    FOLDER.with(|folder| {
        folder.put("times.txt", bytes);
        dmp_fuzz::read_log(folder.path(), &dmp_log::LogOptions::default());
        let _ = dmp_log::read_trajectory(&folder.path().join("run.txt"));
    });
});
