use std::path::PathBuf;

use dmp_log::LogError;
use dmp_map::MapError;
use dmp_reduce::ReduceError;

/// Why a log and its runs cannot be scored.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum EvaluateError {
    /// There is nothing to score.
    #[error("no run to score")]
    NoRuns,
    /// Two runs share a name.
    #[error("two runs are called `{name}`: give them names of their own, as NAME=FILE")]
    SameName {
        /// The name.
        name: String,
    },
    /// Whoever watches asked for it to stop.
    #[error("stopped before the end")]
    Cancelled,
    /// A setting outside its range.
    #[error("{setting} {value}: {why}")]
    Setting {
        /// Which.
        setting: &'static str,
        /// What it was set to.
        value: String,
        /// What it must be.
        why: &'static str,
    },
    /// Less memory than the threads need.
    #[error("memory {}: {threads} threads and {runs} runs on this log need at least {}; fewer --threads need less",
        mebibytes(*asked), mebibytes(*needed))]
    TooLittleMemory {
        /// Bytes asked for.
        asked: usize,
        /// Bytes needed.
        needed: usize,
        /// Threads.
        threads: usize,
        /// Runs to score.
        runs: usize,
    },
    /// A file system has less room than will be written for sure.
    #[error(
        "{}: about {} will be written here, {} at the very least, and {} are free: make room, or name another place ({option})",
        folder.display(), in_words(*bytes), in_words(*least_bytes), in_words(*free_bytes)
    )]
    NoRoom {
        /// The folder.
        folder: PathBuf,
        /// Bytes that will be written there, about.
        bytes: u64,
        /// Fewer it cannot be.
        least_bytes: u64,
        /// Bytes that are free.
        free_bytes: u64,
        /// What moves it to another folder.
        option: &'static str,
    },
    /// The log has no scans.
    #[error("{}: the log has no scans", path.display())]
    NoScans {
        /// The log.
        path: PathBuf,
    },
    /// Scans and poses must be paired line by line, but there are more of one.
    #[error(
        "run `{run}`: {poses} poses for {scans} scans; without stamps {which} the n-th pose belongs to the n-th scan, so there must be as many"
    )]
    LinePairing {
        /// The run.
        run: String,
        /// Poses of the trajectory.
        poses: usize,
        /// Scans of the log.
        scans: usize,
        /// Where stamps are missing.
        which: &'static str,
    },
    /// A trajectory has a pose for none of the scans, or hardly any.
    #[error("run `{run}`: {found} of {scans} scans have a pose: {why}")]
    NoOverlap {
        /// The run.
        run: String,
        /// Scans with a pose.
        found: usize,
        /// Scans of the log.
        scans: usize,
        /// Spans and gap, in words.
        why: String,
    },
    /// Every run has poses, but no scan has one in all of them.
    #[error("no scan has a pose in every run")]
    NothingInCommon,
    /// The drive is too short to choose places from.
    #[error(
        "the way is {travel_m:.0} m, {places} places: there is nothing to choose among; score all of it, without --quick"
    )]
    NoPlaces {
        /// The way, metres.
        travel_m: f64,
        /// Places.
        places: usize,
    },
    /// The index of a log does not tell when its scans were made.
    #[error(
        "{}: its index tells the times of its scans no better than to {error_s:.1} s, which does not tell where they were \
         made: score a sample of its scans, --sample",
        path.display()
    )]
    VagueStamps {
        /// The log.
        path: PathBuf,
        /// How far a stamp is off, seconds.
        error_s: f64,
    },
    /// Not one return is left to score.
    #[error("no return is used: {0}")]
    NoReturns(String),
    /// Maps with different voxels cannot be compared.
    #[error("the maps of `{a}` and `{b}` have voxels of {a_m} and {b_m} m: their scores cannot be compared")]
    DifferentVoxels {
        /// One run.
        a: String,
        /// Another.
        b: String,
        /// The one's voxel edge, metres.
        a_m: f64,
        /// The other's.
        b_m: f64,
    },
    /// The log gave other returns when it was read again.
    #[error(
        "the log changed while it was read: {first} returns were used in the first pass, {second} in the second"
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
        /// What happened.
        source: MapError,
    },
    /// From the work folder.
    #[error(transparent)]
    Work(MapError),
    /// What was kept of an earlier process is not what this one would keep.
    #[error("the checkpoint cannot be understood")]
    Checkpoint(#[source] postcard::Error),
    /// From the reducer; these speak of this program, not of the user's input.
    #[error(transparent)]
    Reduce(#[from] ReduceError),
    /// The threads could not be started.
    #[error("cannot start {threads} threads")]
    Threads {
        /// How many were asked for.
        threads: usize,
        /// Why.
        source: rayon::ThreadPoolBuildError,
    },
}

/// Rounded up: where it is little, to the kibibyte.
pub(crate) fn in_words(bytes: u64) -> String {
    if bytes < 10 << 20 {
        format!("{} KiB", bytes.div_ceil(1 << 10))
    } else {
        format!("{} MiB", bytes.div_ceil(1 << 20))
    }
}

/// Rounded up.
fn mebibytes(bytes: usize) -> String {
    format!("{} MiB", bytes.div_ceil(1 << 20))
}

impl EvaluateError {
    /// From the work folder.
    pub(crate) fn work(source: impl Into<MapError>) -> Self {
        Self::Work(source.into())
    }

    pub(crate) fn map_of(run: &str) -> impl Fn(MapError) -> Self {
        move |source| Self::Map { run: run.to_owned(), source }
    }

    /// Whether the command was used wrongly, rather than the data being at fault.
    pub fn is_usage(&self) -> bool {
        match self {
            Self::TooLittleMemory { .. }
            | Self::NoRuns
            | Self::SameName { .. }
            | Self::NoPlaces { .. }
            | Self::VagueStamps { .. }
            | Self::Setting { .. } => true,
            Self::Log(error) => error.is_usage(),
            _ => false,
        }
    }
}
