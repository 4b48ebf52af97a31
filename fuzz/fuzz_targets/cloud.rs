//! Maps: LAS, LAZ, PLY, PCD, told apart by the names they are given.
#![no_main]

use libfuzzer_sys::fuzz_target;

thread_local!(static FOLDER: dmp_fuzz::Folder = dmp_fuzz::Folder::default());

fuzz_target!(|bytes: &[u8]| {
    let name = match bytes.first() {
        Some(b'L') => "map.laz",
        Some(b'p') => "map.ply",
        _ => "map.pcd",
    };
    FOLDER.with(|folder| dmp_fuzz::read_points(&folder.put(name, bytes)));
});
