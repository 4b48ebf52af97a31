//! A folder with a depth image, of any size.
#![no_main]

use dmp_log::LogOptions;

dmp_fuzz::file_target!("00000.png", |path| {
    let folder = path.parent().expect("a folder");
    let camera = Some("525,525,319.5,239.5".parse().expect("a camera"));
    read_log(folder, &LogOptions { camera, ..LogOptions::default() })
});
