//! Errors of joining reports.

use dmp_log::LogError;

/// A fact that reports must share for comparable scores.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum MadeWith {
    /// The program.
    #[error("version of dmp")]
    Version,
    /// The log that was scored.
    #[error("log")]
    Log,
    /// The settings.
    #[error("settings")]
    Settings,
    /// The scans.
    #[error("frames")]
    Frames,
    /// The returns on the vehicle itself.
    #[error("vehicle")]
    Vehicle,
}

/// Why reports cannot be joined.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum JoinError {
    /// No report was given.
    #[error("no result to compare")]
    NoReports,
    /// Their scores cannot be compared.
    #[error(
        "{} and {} were not made with the same {what}: {field} is {} and {}",
        reports[0], reports[1], values[0], values[1]
    )]
    Different {
        /// The two reports.
        reports: Box<[String; 2]>,
        /// The fact that differs.
        what: MadeWith,
        /// The field of the JSON that differs.
        field: String,
        /// Its value in each.
        values: Box<[String; 2]>,
    },
    /// A report contradicts itself.
    #[error("{report}: {field} names `{name}`, which is not the name of one run")]
    NoSuchRun {
        /// The report.
        report: String,
        /// The field of the JSON.
        field: String,
        /// The value found.
        name: String,
    },
    /// Saved returns differ from those of the other results, or of their own result.
    #[error("{report}: {problem}")]
    Returns {
        /// The result.
        report: String,
        /// The problem.
        problem: String,
    },
    /// A file cannot be read.
    #[error(transparent)]
    Log(#[from] LogError),
    /// The watcher stopped it.
    #[error("stopped")]
    Cancelled,
    /// Two runs have the same name.
    #[error("two runs would be called `{name}`: give each result its own name")]
    SameName {
        /// The name.
        name: String,
    },
}

impl JoinError {
    /// Whether the given names are at fault, rather than the reports.
    pub fn is_usage(&self) -> bool {
        matches!(self, Self::NoReports | Self::SameName { .. })
    }
}
