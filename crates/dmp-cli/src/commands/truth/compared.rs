//! A run beside the reference: what was compared, and what came out.

use dmp_truth::trajectory::{CompareError, Errors, Prepared, Relation, Statistics};
use serde::Serialize;

/// What makes the metrics different.
pub(super) struct Metric<'a> {
    /// `ape` or `rpe`.
    pub(super) name: &'static str,
    pub(super) relation: Relation,
    /// What follows the first line of the title, with a line break before it.
    pub(super) title_tail: String,
    /// Goes into the JSON.
    pub(super) pairs: Option<PairsJson>,
    pub(super) errors: &'a dyn Fn(&Prepared) -> Result<Errors, CompareError>,
}

/// How pairs were taken, in the JSON.
#[derive(Debug, Serialize)]
pub(super) struct PairsJson {
    pub(super) delta: f64,
    pub(super) delta_unit: &'static str,
    pub(super) delta_tol: f64,
    pub(super) all_pairs: bool,
    pub(super) from_reference: bool,
}

/// A run beside the reference.
pub(super) struct Compared {
    /// Reference and estimate, for people.
    pub(super) names: [String; 2],
    pub(super) formats: [&'static str; 2],
    /// Poses in the files.
    pub(super) counts: [usize; 2],
    pub(super) notes: Vec<String>,
    pub(super) title: String,
    pub(super) prepared: Prepared,
    pub(super) errors: Errors,
    pub(super) stats: Statistics,
}

/// The notes of all runs, each once: the reference is one file.
pub(super) fn all_notes(runs: &[Compared]) -> Vec<String> {
    let mut all: Vec<String> = Vec::new();
    for note in runs.iter().flat_map(|run| &run.notes) {
        if !all.contains(note) {
            all.push(note.clone());
        }
    }
    all
}
