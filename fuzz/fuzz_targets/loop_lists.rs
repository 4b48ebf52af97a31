//! The lists that belong to a pose graph: labels of loop candidates, times of vertices.
#![no_main]

use dmp_log::{parse_keyframe_times, parse_loop_labels};

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    if let Ok(found) = parse_loop_labels(bytes) {
        assert!(found.labels.keys().all(|(a, b)| a < b && found.of(*b, *a).is_some()));
    }
    if let Ok(times) = parse_keyframe_times(bytes) {
        assert!(times.stamps_ns.is_sorted_by(|a, b| a < b));
        let ids = times.ids.clone().unwrap_or_else(|| (0..times.stamps_ns.len() as i64).collect());
        assert_eq!(times.of_vertices(&ids).expect("a stamp for each"), times.stamps_ns);
    }
});
