//! The parser of `npy`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let _ = dmp_log::parse_npy(bytes);
});
