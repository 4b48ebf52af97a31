//! Errors of a score in parts.

use dmp_lengths::thousands;
use std::path::PathBuf;

use dmp::EvaluateError;
use dmp_disk::DiskError;
use dmp_log::LogError;
use dmp_map::MapError;
use dmp_reduce::ReduceError;

use super::stage::Stage;

/// An error of a part of a score. Every variant names the file, the part or the value.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ShardError {
    /// An error that scoring in one process also has.
    #[error(transparent)]
    Evaluate(#[from] EvaluateError),
    /// The log cannot be read.
    #[error(transparent)]
    Log(#[from] LogError),
    /// A file of a part cannot be read or written.
    #[error(transparent)]
    Disk(#[from] DiskError),
    /// Sums of voxels or a map.
    #[error(transparent)]
    Map(#[from] MapError),
    /// A log that is not on disk.
    #[error("the scans are in memory: parts need a log on disk")]
    NoIndex,
    /// The plan changed after it was written.
    #[error(
        "the plan has changed since it was made: the hash of its content is {found}, the plan states {said}"
    )]
    PlanChanged {
        /// The hash of its content.
        found: String,
        /// The hash that it states.
        said: String,
    },
    /// The plan was made by another version.
    #[error("the plan is {schema} of dmp {version}; this is dmp {}: make it anew", env!("CARGO_PKG_VERSION"))]
    OtherVersion {
        /// Its schema.
        schema: String,
        /// The version that made it.
        version: String,
    },
    /// This machine finds other segments.
    #[error("this machine finds other segments than the plan has: the results would differ")]
    OtherSegments,
    /// Parts of a stage are missing.
    #[error("{}: {stage} is not done: {missing}", folder.display())]
    Missing {
        /// Their folder.
        folder: PathBuf,
        /// The stage.
        stage: Stage,
        /// Which, in words.
        missing: String,
    },
    /// A file that belongs to another plan, or to another part.
    #[error("{}: found {found}, expected {expected}", path.display())]
    OtherPart {
        /// The file.
        path: PathBuf,
        /// The part named in the file.
        found: String,
        /// The expected part.
        expected: String,
    },
    /// The content of a part cannot be decoded.
    #[error("{}: its content cannot be read: {detail}", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// The problem.
        detail: String,
    },
    /// A scan is in several parts.
    #[error("{stage}: scan {scan} of the plan is in two parts")]
    ScanTwice {
        /// The stage.
        stage: Stage,
        /// The ordinal of the scan among those of the plan, from 0.
        scan: usize,
    },
    /// Scans are in no part.
    #[error("{stage}: {} of {} scans of the plan are in no part", thousands(.missing), thousands(.scans))]
    ScansMissing {
        /// The stage.
        stage: Stage,
        /// Their number.
        missing: u64,
        /// Number of scans of the plan.
        scans: u64,
    },
}

impl ShardError {
    /// Whether the request is at fault.
    pub fn is_usage(&self) -> bool {
        match self {
            Self::Evaluate(error) => error.is_usage(),
            Self::Log(error) => error.is_usage(),
            Self::NoIndex => true,
            _ => false,
        }
    }
}

impl From<ReduceError> for ShardError {
    fn from(error: ReduceError) -> Self {
        Self::Evaluate(error.into())
    }
}
