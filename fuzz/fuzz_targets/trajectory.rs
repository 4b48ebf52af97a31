//! Trajectories in text: TUM, KITTI, EuRoC, Redwood, csv with names of columns.
#![no_main]

use dmp_log::{TrajectoryFormat, parse_euroc, parse_kitti, parse_raw, parse_redwood_log, parse_tum};

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let _ = (parse_tum(bytes), parse_kitti(bytes), parse_euroc(bytes), parse_redwood_log(bytes));
    for format in TrajectoryFormat::ALL {
        let _ = parse_raw(bytes, format);
    }
});
