//! Pose graphs in g2o's text format, and lists that belong to one: labels of loops, times of vertices.

mod candidates;
mod graph;
mod keyframe_times;
mod labels;
mod record;
mod vertices;
mod write;

pub use candidates::{Candidate, CandidateFault, LoopCandidates, SkippedCandidate};
pub use candidates::{parse_loop_candidates, read_loop_candidates};
pub use graph::{PoseGraphFile, parse_pose_graph, read_pose_graph};
pub use keyframe_times::{
    KeyframeTimes, KeyframeTimesFault, parse_keyframe_times, parse_keyframe_times_in, read_keyframe_times,
    read_keyframe_times_in, write_keyframe_times,
};
pub use labels::{LoopLabels, parse_loop_labels, read_loop_labels};
pub(crate) use record::{Record, RecordType, Vertex, is_tag, records};
pub(crate) use vertices::Vertices;
pub use write::{write_pose_edges, write_pose_graph};

use crate::LogError;
use crate::file::{read_text, shorten};
use std::collections::BTreeMap;
use std::path::Path;

/// Largest graph that is read: five million vertices, with as many edges.
const MAX_BYTES: u64 = 2 << 30;

fn read_bytes(path: &Path) -> Result<Vec<u8>, LogError> {
    read_text(path, "pose graph", MAX_BYTES)
}

/// Two vertices without a direction, the smaller id first.
fn undirected(a: i64, b: i64) -> (i64, i64) {
    (a.min(b), a.max(b))
}

/// Lines that are passed over, by their first words.
#[derive(Debug, Default)]
struct Others(BTreeMap<String, u64>);

impl Others {
    fn count(&mut self, tag: &str) {
        *self.0.entry(shorten(tag)).or_default() += 1;
    }

    /// What a file without what was looked for has instead.
    fn in_words(&self) -> String {
        let mut words: Vec<String> =
            self.0.iter().take(3).map(|(tag, count)| format!("{count} `{tag}`")).collect();
        if self.0.len() > words.len() {
            words.push("others".into());
        }
        if words.is_empty() { "nothing".into() } else { words.join(", ") }
    }
}
