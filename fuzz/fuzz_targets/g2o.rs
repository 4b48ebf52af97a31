//! The parser of `g2o`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let _ = dmp_log::parse_g2o(bytes);
});
