//! The parsers of pose graphs and loop candidates: the candidates begin behind the first line of `---`.
#![no_main]

use dmp_log::{parse_loop_candidates, parse_pose_graph, write_pose_graph};

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let split = bytes.windows(4).position(|part| part == b"---\n");
    let (graph, candidates) = split.map_or((bytes, bytes), |at| (&bytes[..at], &bytes[at + 4..]));
    let Ok(file) = parse_pose_graph(graph) else { return };
    let _ = parse_loop_candidates(candidates, &file);
    let mut again = Vec::new();
    write_pose_graph(&mut again, &file.graph).expect("a list takes all bytes");
    assert_eq!(parse_pose_graph(&again).expect("a graph that was written").graph, file.graph);
});
