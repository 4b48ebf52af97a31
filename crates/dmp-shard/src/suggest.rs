//! Suggests a number of parts for each stage.

use dmp::PlannedScore;
use serde::{Deserialize, Serialize};

// Measured on one core: docs/scale.md.

/// Approximate time to fuse, and to cast, a return in each run, and to register a pair of visits, seconds.
const FUSE_S: f64 = 5e-8;
const CAST_S: f64 = 2.5e-7;
const PAIR_S: f64 = 0.04;
/// Approximate time to merge the voxels of a return, seconds.
const MERGE_S: f64 = 8e-9;
/// A part takes at least this long, so that its start-up is negligible, and not much longer, so that little
/// is lost with it.
const LEAST_S: f64 = 10.0;
const MOST_S: f64 = 120.0;

/// The machine that does the parts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Machine {
    /// Cores, of all workers together.
    pub cores: usize,
}

/// The suggested number of parts for each stage.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Suggested {
    /// Number of cores it is suggested for.
    pub cores: usize,
    /// Number of fuse parts.
    pub fuse: u32,
    /// Number of merge parts.
    pub merge: u32,
    /// Number of cast parts.
    pub cast: u32,
    /// Number of drift parts.
    pub drift: u32,
    /// Least memory of a part, bytes.
    pub memory_bytes: u64,
}

impl Suggested {
    pub(super) fn of(planned: &PlannedScore<'_>, machine: Machine) -> Self {
        let runs = planned.runs().len() as f64;
        let fused = planned.returns() as f64 * runs;
        let pairs = |run| planned.revisits(run).pairs().len() as f64;
        let pairs: f64 = (0..planned.runs().len()).map(pairs).sum();
        let parts = |work_s: f64| parts_of(work_s, machine.cores);
        Self {
            cores: machine.cores,
            fuse: parts(FUSE_S * fused),
            merge: parts(MERGE_S * fused),
            cast: parts(CAST_S * fused),
            drift: parts(PAIR_S * pairs),
            memory_bytes: planned.least_memory_bytes(),
        }
    }
}

/// The number of cores or a multiple, as long as each part takes long enough.
fn parts_of(work_s: f64, cores: usize) -> u32 {
    let cores = cores.clamp(1, 100_000) as f64;
    let rounds = (work_s / (cores * MOST_S)).ceil().max(1.0);
    (cores * rounds).min((work_s / LEAST_S).floor()).clamp(1.0, 1e6) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_neither_short_nor_long() {
        assert_eq!(parts_of(0.5, 32), 1);
        assert_eq!(parts_of(95.0, 32), 9);
        assert_eq!(parts_of(1000.0, 32), 32);
        // 312 s for each core: three rounds.
        assert_eq!(parts_of(10_000.0, 32), 96);
        assert_eq!(parts_of(1e12, 2048), 1_000_000);
    }
}
