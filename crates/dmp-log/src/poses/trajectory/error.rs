//! What can be wrong with a trajectory.

use crate::{LogError, ParseError};
use std::path::Path;

/// What can be wrong with a trajectory's text.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TrajectoryParseError {
    /// A line is wrong.
    #[error(transparent)]
    Line(#[from] ParseError),
    /// The lines are well, the poses contradict each other.
    #[error(transparent)]
    Poses(#[from] dmp_sensor::TrajectoryError),
}

impl TrajectoryParseError {
    /// The same with the name of the file.
    pub fn in_file(self, path: &Path) -> LogError {
        match self {
            Self::Line(error) => error.in_file(path),
            Self::Poses(source) => LogError::Trajectory { path: path.into(), source },
        }
    }
}
