//! What lies beside depth images: the list of them, and behind the first line of `---` their camera.
#![no_main]

use libfuzzer_sys::fuzz_target;

/// An image of 2 x 1 pixels, its values 1000 and 0.
const IMAGE: &[u8] = include_bytes!("two_pixels.png");

thread_local!(static FOLDER: dmp_fuzz::Folder = {
    let folder = dmp_fuzz::Folder::default();
    folder.put("0.png", IMAGE);
    folder.put("1.5.png", IMAGE);
    folder
});

fuzz_target!(|bytes: &[u8]| {
    let split = bytes.windows(4).position(|part| part == b"---\n");
    let (list, camera) = split.map_or((bytes, &b"{}"[..]), |at| (&bytes[..at], &bytes[at + 4..]));
    FOLDER.with(|folder| {
        folder.put("depth.txt", list);
        folder.put("camera.json", camera);
        dmp_fuzz::read_log(folder.path(), &dmp_log::LogOptions::default());
    });
});
