//! Errors of an evaluation.

use dmp_lengths::thousands;
use std::path::{Path, PathBuf};

use dmp_disk::DiskError;
use dmp_log::{LogError, shown_path};
use dmp_map::{MapError, Store};
use dmp_reduce::ReduceError;

use crate::asked::setting_name::SettingName;
use crate::asked::unposed::Unposed;

/// Why a log and its runs cannot be scored.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum EvaluateError {
    /// No run was given.
    #[error("no run to score")]
    NoRuns,
    /// Two runs share a name.
    #[error("two runs are named `{name}`: give each its own name")]
    SameName {
        /// The name.
        name: String,
    },
    /// The watcher stopped it.
    #[error("stopped before the end")]
    Cancelled,
    /// A setting outside its range.
    #[error("{}", self.message_with(&SettingName::quoted))]
    Setting {
        /// The setting.
        setting: SettingName,
        /// Its value.
        value: String,
        /// What it must be.
        why: &'static str,
        /// Another setting that achieves the purpose.
        remedy: Option<Remedy>,
    },
    /// Less memory than the threads need.
    #[error("{}", self.message_with(&SettingName::quoted))]
    TooLittleMemory {
        /// Given bytes.
        asked: usize,
        /// Bytes needed.
        needed: usize,
        /// Number of threads.
        threads: usize,
        /// Number of runs.
        runs: usize,
    },
    /// Less memory than the poses of the runs need.
    #[error("{}", self.message_with(&SettingName::quoted))]
    TooLittleForPoses {
        /// Given bytes.
        asked: usize,
        /// Bytes needed.
        needed: usize,
        /// Poses of all runs.
        poses: u64,
    },
    /// Less memory than the tree of the densest tile of a map needs while it is built.
    #[error("{}", self.message_with(&SettingName::quoted))]
    TooLittleForTile {
        /// Given bytes.
        asked: usize,
        /// Bytes needed.
        needed: usize,
        /// Surfels of the tile.
        surfels: u64,
    },
    /// A file system has less room than will be written, even if the estimate is half as much again as needed.
    #[error("{}", self.message_with(&SettingName::quoted))]
    NoRoom {
        /// The folder.
        folder: PathBuf,
        /// Approximate bytes that will be written there.
        bytes: u64,
        /// Lower limit in all measurements.
        least_bytes: u64,
        /// Free bytes.
        free_bytes: u64,
        /// The setting that selects another folder.
        setting: SettingName,
    },
    /// The log has no scans.
    #[error("{}: the log has no scans", path.display())]
    NoScans {
        /// The log.
        path: PathBuf,
    },
    /// Scans and poses must be paired line by line, but their numbers differ.
    #[error(
        "run `{run}`: {} poses for {} scans; without stamps {which} the n-th pose belongs to the n-th scan, so there must be as many",
        thousands(.poses),
        thousands(.scans)
    )]
    LinePairing {
        /// The run.
        run: String,
        /// Number of poses.
        poses: usize,
        /// Number of scans.
        scans: usize,
        /// Which of them have no stamps.
        which: &'static str,
    },
    /// Poses without stamps cannot use those of the scans.
    #[error(
        "run `{run}`: its poses have no stamps, and those of the scans do not ascend (scan {scan}, {stamp_s:.6} s), so the times of points cannot be used: give the trajectory stamps, or take each scan for an instant"
    )]
    LinesOutOfTime {
        /// The run.
        run: String,
        /// The scan whose stamp is not later than that of the scan before.
        scan: usize,
        /// Its stamp, seconds.
        stamp_s: f64,
    },
    /// With its clock offset, a run's stamps are out of range.
    #[error("run `{run}`: its stamps, {shift_s} s later, are beyond the years 1677 to 2262")]
    BeyondTimes {
        /// The run.
        run: String,
        /// The offset, seconds.
        shift_s: f64,
    },
    /// A trajectory has poses for no scan, or for very few.
    #[error("{}", self.message_with(&SettingName::quoted))]
    NoOverlap {
        /// The run.
        run: String,
        /// Number of scans with a pose.
        found: usize,
        /// Number of scans.
        scans: usize,
        /// Why the others have none.
        why: Unposed,
    },
    /// No scan is near enough in time to a run's poses.
    #[error("{}", self.message_with(&SettingName::quoted))]
    TooSparse {
        /// The run.
        run: String,
        /// The longest time between two poses, seconds.
        gap_s: f64,
        /// The uncertainty of the sensor's position there, metres.
        off_m: f64,
    },
    /// No return remains to score.
    #[error("no return is used: {0}")]
    NoReturns(String),
    /// The scans of the log contradict the only run, or all of them, beyond doubt.
    #[error("no run to score: run `{name}` is excluded: {why}")]
    OtherLog {
        /// The name of the first.
        name: String,
        /// The test that it fails.
        why: String,
    },
    /// Depth images were read with guessed units, and with others they fit the poses.
    #[error(
        "{}: {} units of depth a metre were guessed, and {} fit the poses better: {:.0} % of the returns meet those of nearby \
         images against {:.0} %. Put `\"depth_scale\": {}` into a camera.json beside the images: docs/guide/depth-cameras.md",
        shown_path(path), units_per_m[0], units_per_m[1], 100.0 * together[1], 100.0 * together[0], units_per_m[1]
    )]
    DepthUnits {
        /// The folder.
        path: PathBuf,
        /// The guessed units, and those that fit.
        units_per_m: [f64; 2],
        /// The share of returns that meet with each.
        together: [f64; 2],
    },
    /// Maps with different voxels cannot be compared.
    #[error("the maps of `{a}` and `{b}` have voxels of {a_m} and {b_m} m: their scores cannot be compared")]
    DifferentVoxels {
        /// One run.
        a: String,
        /// Another.
        b: String,
        /// The voxel edge of the first, metres.
        a_m: f64,
        /// That of the second.
        b_m: f64,
    },
    /// A given map is empty.
    #[error("{}", self.message_with(&SettingName::quoted))]
    EmptyMap {
        /// Its file.
        path: PathBuf,
        /// For a cloud or a mesh, the number of voxels with points, none of which has a surfel; `None` for a saved map.
        thin_voxels: Option<u64>,
        /// Their edge, metres.
        voxel_m: f64,
        /// Points or triangles that are not finite.
        points_dropped: u64,
    },
    /// The log gave other returns in the second pass.
    #[error(
        "the log changed while it was read: {} returns were used in the first pass, {} in the second",
        thousands(.first),
        thousands(.second)
    )]
    LogChanged {
        /// Returns used in the first pass.
        first: u64,
        /// Returns used in the second.
        second: u64,
    },
    /// From the log or a file beside it.
    #[error(transparent)]
    Log(#[from] LogError),
    /// From a map.
    #[error("run `{run}`")]
    Map {
        /// The run whose map it is.
        run: String,
        /// The error.
        source: MapError,
    },
    /// From the work folder, or from a file that is no run's map.
    #[error(transparent)]
    Work(#[from] MapError),
    /// The checkpoint cannot be decoded.
    #[error("the checkpoint cannot be understood")]
    Checkpoint(#[source] postcard::Error),
    /// From the reducer: an internal error, not one of the user's input.
    #[error(transparent)]
    Reduce(#[from] ReduceError),
    /// The threads could not be started.
    #[error("cannot start {threads} threads")]
    Threads {
        /// The given number.
        threads: usize,
        /// The reason.
        source: rayon::ThreadPoolBuildError,
    },
}

/// The remedy for a setting that does not fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Remedy {
    /// Use the voxels of the given map.
    VoxelOfMap,
}

impl From<DiskError> for EvaluateError {
    fn from(error: DiskError) -> Self {
        Self::Work(error.into())
    }
}

/// Rounded up; small values to the kibibyte.
pub fn in_words(bytes: u64) -> String {
    if bytes < 10 << 20 {
        format!("{} KiB", bytes.div_ceil(1 << 10))
    } else {
        format!("{} MiB", bytes.div_ceil(1 << 20))
    }
}

/// "1 voxel", "1,234 voxels".
pub fn in_voxels(voxels: u64) -> String {
    format!("{} {}", thousands(voxels), if voxels == 1 { "voxel" } else { "voxels" })
}

/// A voxel edge, which is a multiple of 2^-13 m, in whole millimetres, as it was given.
pub fn as_asked_m(voxel_m: f64) -> f64 {
    (1e3 * voxel_m).round() / 1e3
}

fn mebibytes(bytes: usize) -> String {
    format!("{} MiB", bytes.div_ceil(1 << 20))
}

impl EvaluateError {
    /// A setting that cannot be used, without another that would do.
    pub fn setting(setting: SettingName, value: impl Into<String>, why: &'static str) -> Self {
        Self::Setting { setting, value: value.into(), why, remedy: None }
    }

    /// Rejects a map without a surfel, made from a file; `thin_voxels` and `points_dropped` as in
    /// `dmp::CloudMap`, `None` and 0 for a map not made of a cloud or a mesh.
    ///
    /// # Errors
    /// [`EvaluateError::EmptyMap`].
    pub fn if_empty(
        path: &Path,
        map: &Store,
        thin_voxels: Option<u64>,
        points_dropped: u64,
    ) -> Result<(), Self> {
        if map.surfels() > 0 {
            return Ok(());
        }
        let voxel_m = map.lattice().voxel_m();
        Err(Self::EmptyMap { path: path.to_owned(), thin_voxels, voxel_m, points_dropped })
    }

    /// An error of the map of a run, with its name.
    pub fn map_of(run: &str) -> impl Fn(MapError) -> Self {
        move |source| Self::Map { run: run.to_owned(), source }
    }

    /// Whether the command was used wrongly, as opposed to bad data.
    pub fn is_usage(&self) -> bool {
        match self {
            Self::TooLittleMemory { .. }
            | Self::TooLittleForPoses { .. }
            | Self::TooLittleForTile { .. }
            | Self::NoRuns
            | Self::SameName { .. }
            | Self::Setting { .. } => true,
            Self::Log(error) => error.is_usage(),
            _ => false,
        }
    }

    /// The message, with `name`'s names for settings: a command line may have options for them.
    pub fn message_with(&self, name: &dyn Fn(SettingName) -> String) -> String {
        match self {
            Self::Setting { setting, value, why, remedy } => {
                let remedy = remedy.map(|remedy| remedy.message_with(name)).unwrap_or_default();
                format!("{setting} {value}: {why}{remedy}")
            }
            Self::TooLittleMemory { asked, needed, threads, runs } => format!(
                "memory {}: {threads} threads and {runs} runs on this log need at least {}; fewer {} need less",
                mebibytes(*asked),
                mebibytes(*needed),
                name(SettingName::Threads)
            ),
            Self::TooLittleForPoses { asked, needed, poses } => format!(
                "memory {}: {} poses need at least {}: give more {}, or write the poses of the scans only",
                mebibytes(*asked),
                thousands(*poses),
                mebibytes(*needed),
                name(SettingName::Memory)
            ),
            Self::TooLittleForTile { asked, needed, surfels } => format!(
                "memory {}: the {} surfels of a tile of the map need at least {}: give more {}, or larger voxels",
                mebibytes(*asked),
                thousands(*surfels),
                mebibytes(*needed),
                name(SettingName::Memory)
            ),
            Self::NoRoom { folder, bytes, least_bytes, free_bytes, setting } => format!(
                "{}: about {} will be written here, at least {}, and {} are free: free disk space, or choose another \
                 folder ({})",
                folder.display(),
                in_words(*bytes),
                in_words(*least_bytes),
                in_words(*free_bytes),
                name(*setting)
            ),
            Self::NoOverlap { run, found, scans, why } => {
                let why = why.message_with(run, name);
                let (found, scans) = (thousands(found), thousands(scans));
                format!("run `{run}`: {found} of {scans} scans have a pose: {why}")
            }
            Self::TooSparse { run, gap_s, off_m } => format!(
                "run `{run}`: no scan is close enough to a pose. Poses are up to {gap_s:.1} s apart, and the sensor may be \
                 {:.0} cm off between them. Give an odometry with {}, or accept the poses with {} {}",
                100.0 * off_m,
                SettingName::Between.for_run(run, "FILE", name),
                name(SettingName::MaxTimeGap),
                gap_s.ceil()
            ),
            Self::EmptyMap { path, thin_voxels, voxel_m, points_dropped } => {
                let voxel_m = as_asked_m(*voxel_m);
                let why = match (thin_voxels, points_dropped) {
                    (None, _) => format!("it has no surfel, with voxels of {voxel_m} m"),
                    (Some(0), 0) => "it has no points".to_owned(),
                    (Some(0), dropped) => format!("none of its {} points is finite", thousands(dropped)),
                    (Some(voxels), _) => format!(
                        "its points span no surface in {} of {voxel_m} m: check its density and its unit, or try larger \
                         voxels ({})",
                        in_voxels(*voxels),
                        name(SettingName::Voxel)
                    ),
                };
                format!("{}: the map is empty: {why}", path.display())
            }
            other => other.to_string(),
        }
    }
}

impl Remedy {
    fn message_with(self, name: &dyn Fn(SettingName) -> String) -> String {
        match self {
            Self::VoxelOfMap => format!("; remove {} to use those of the map", name(SettingName::Voxel)),
        }
    }
}
