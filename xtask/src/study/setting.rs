//! Settings under which the drives are scored.

use dmp::{Config, DriftPairs, SegmentLength};

/// What is changed against the default.
#[derive(Debug, Clone)]
pub(super) struct Setting {
    pub(super) name: &'static str,
    voxel_m: Option<f64>,
    segment_m: Option<f64>,
    every: usize,
    free_space: bool,
    /// Whether own points are kept out by fusing maps without them.
    pub(super) fuse_without_own: bool,
    /// Only these estimates; all of them where there is none.
    only: &'static [&'static str],
    /// Whether surface distance, the peers and the truth about consistency are measured: they do not depend on
    /// the setting.
    pub(super) against_truth: bool,
}

const DEFAULT: Setting = Setting {
    name: "default",
    voxel_m: None,
    segment_m: None,
    every: 1,
    free_space: false,
    fuse_without_own: false,
    only: &[],
    against_truth: true,
};

/// Estimates that settings are compared on: some of every kind.
const SOME: [&str; 11] = [
    "truth",
    "noise-0.03m",
    "noise-0.1m",
    "drift-0.3m",
    "drift-1m",
    "drift-3m",
    "closed-1m",
    "false-loop-10m",
    "collapsed-0.1",
    "mixed-0.3m",
    "odometry-default",
];
/// Other settings are compared with this one: half of the scans, some estimates.
const HALF: Setting = Setting { name: "auto", every: 2, only: &SOME, against_truth: false, ..DEFAULT };

/// All of them, the default first.
pub(super) fn settings() -> Vec<Setting> {
    let voxel = |name, edge_m| Setting { name, voxel_m: Some(edge_m), ..HALF };
    let segment = |name, length_m| Setting { name, segment_m: Some(length_m), ..HALF };
    vec![
        DEFAULT,
        HALF,
        voxel("voxel 0.2 m", 0.2),
        voxel("voxel 0.3 m", 0.3),
        voxel("voxel 0.5 m", 0.5),
        segment("segments of 4 m", 4.0),
        segment("segments of 24 m", 24.0),
        segment("segments of 60 m", 60.0),
        Setting { name: "maps without own points", fuse_without_own: true, ..HALF },
        Setting { name: "free space", free_space: true, ..HALF },
    ]
}

impl Setting {
    pub(super) fn config(&self) -> Config {
        let Self { voxel_m, segment_m, every, free_space, .. } = *self;
        let segment = segment_m.map(SegmentLength::Metres);
        let drift = if self.against_truth { DriftPairs::All } else { DriftPairs::None };
        Config { voxel_m, segment, every, free_space, drift, ..Config::default() }
    }

    pub(super) fn wants(&self, estimate: &str) -> bool {
        self.only.is_empty() || self.only.contains(&estimate)
    }

    /// As part of a file's name.
    pub(super) fn file_stem(&self) -> String {
        self.name.replace(' ', "-")
    }
}
