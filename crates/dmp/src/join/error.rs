//! Why reports cannot stand beside each other.

use dmp_log::LogError;

/// What reports must have in common for their scores to be comparable.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum MadeWith {
    /// The program.
    #[error("version of dmp")]
    Version,
    /// What was scored.
    #[error("log")]
    Log,
    /// How it was scored.
    #[error("settings")]
    Settings,
    /// Which scans were.
    #[error("frames")]
    Frames,
    /// How the drive was cut.
    #[error("segments")]
    Segments,
    /// What was taken for the vehicle.
    #[error("vehicle")]
    Vehicle,
    /// Which returns were scored.
    #[error("returns")]
    Returns,
    /// Which are in the maps.
    #[error("returns in the maps")]
    MapReturns,
}

/// Why reports cannot stand beside each other.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum JoinError {
    /// There is nothing to join.
    #[error("no result to compare")]
    NoReports,
    /// Their scores cannot be compared.
    #[error(
        "{} and {} were not made with the same {what}: {field} is {} and {}",
        reports[0], reports[1], values[0], values[1]
    )]
    Different {
        /// The two.
        reports: Box<[String; 2]>,
        /// What they do not have in common.
        what: MadeWith,
        /// The field of the JSON that differs.
        field: String,
        /// Its value in each.
        values: Box<[String; 2]>,
    },
    /// What was scored depends on which runs there were.
    #[error(
        "{report}: it scored a sample of places, which depends on all runs of the command: score the runs in one command"
    )]
    OfPlaces {
        /// The report.
        report: String,
    },
    /// A report contradicts itself.
    #[error("{report}: {field} names `{name}`, which is not the name of one run")]
    NoSuchRun {
        /// The report.
        report: String,
        /// The field of the JSON.
        field: String,
        /// What stands there.
        name: String,
    },
    /// The returns that were kept are not those of the other results, or of the result itself.
    #[error("{report}: {problem}")]
    Returns {
        /// The result.
        report: String,
        /// What is wrong.
        problem: String,
    },
    /// A file cannot be read.
    #[error(transparent)]
    Log(#[from] LogError),
    /// Somebody stopped it.
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
    /// Whether the names that were given are at fault, rather than the reports.
    pub fn is_usage(&self) -> bool {
        matches!(self, Self::NoReports | Self::SameName { .. })
    }
}
