//! The reader of the format that `DMP_FORMAT` names, with the good files, the readers and the list of damage of the tests of
//! `dmp-log`. Without a corpus it begins with the good files.
#![no_main]
#![allow(warnings, reason = "most of the tests' helpers are not used here")]

#[path = "../../crates/dmp-log/tests/it/main.rs"]
mod it;

use std::fs;
use std::path::Path;
use std::sync::OnceLock;

use it::*;
use libfuzzer_sys::{fuzz_mutator, fuzz_target};

/// The format, and the folder in which its files are put.
fn format() -> &'static (mutation::formats::Format, tempfile::TempDir) {
    static FORMAT: OnceLock<(mutation::formats::Format, tempfile::TempDir)> = OnceLock::new();
    FORMAT.get_or_init(|| {
        let name = std::env::var("DMP_FORMAT").unwrap_or_default();
        let all = mutation::formats::all();
        let names: Vec<&str> = all.iter().map(|format| format.name.as_str()).collect();
        assert!(names.contains(&name.as_str()), "DMP_FORMAT is one of {}", names.join(", "));
        let memory = Path::new("/dev/shm");
        let folder = if memory.is_dir() { tempfile::tempdir_in(memory) } else { tempfile::tempdir() };
        let (format, folder) = (mutation::formats::named(&name), folder.unwrap());
        format.prepare(folder.path());
        (format, folder)
    })
}

/// Every run number has its own options of the reader: they follow from the length.
fuzz_target!(|bytes: &[u8]| {
    let (format, folder) = format();
    format.read(folder.path(), bytes, bytes.len() as u64);
});

/// In half of the tries the shared damage, else that of libFuzzer; a file of nothing becomes a good one.
fuzz_mutator!(|data: &mut [u8], size: usize, max_size: usize, seed: u32| {
    let (format, _) = format();
    let mut random = damage::Random::of(&[seed.into()]);
    if size > 1 && random.once_in(2) {
        return libfuzzer_sys::fuzzer_mutate(data, size, max_size);
    }
    let other = random.pick(&format.seeds).clone();
    let mut file = if size > 1 { data[..size].to_vec() } else { other.clone() };
    damage::damage(format.form, &mut file, &other, &mut random);
    file.truncate(max_size);
    data[..file.len()].copy_from_slice(&file);
    file.len()
});
