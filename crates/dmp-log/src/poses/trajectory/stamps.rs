//! Stamps beside a trajectory that has none of its own.

use dmp_lengths::thousands;
use dmp_sensor::{Trajectory, TrajectoryRepairs};

use crate::file::{is_file, read_text};
use crate::logs::{MAX_STAMPS_BYTES, parse_times};
use crate::{LogError, shown_path};
use std::path::Path;

/// Gives poses without stamps those of a `times.txt` beside their file, where that has as many lines.
pub(super) fn from_times_beside(
    path: &Path,
    trajectory: Trajectory,
    notes: &mut Vec<String>,
) -> Result<TrajectoryRepairs, LogError> {
    let times = path.with_file_name("times.txt");
    if let Some(stamps_ns) = times_beside(path)? {
        if stamps_ns.len() == trajectory.len() {
            notes.push(format!("stamps from {}", shown_path(&times)));
            let poses = stamps_ns.into_iter().zip(trajectory.poses().iter().copied()).collect();
            return Trajectory::stamped(poses)
                .map_err(|source| LogError::Trajectory { path: times.clone(), source });
        }
        notes.push(format!(
            "{} has {} lines for {} poses and is not used: the n-th pose belongs to the n-th scan",
            shown_path(&times),
            thousands(stamps_ns.len()),
            thousands(trajectory.len())
        ));
    } else {
        notes.push("no stamps: the n-th pose belongs to the n-th scan".into());
    }
    Ok(TrajectoryRepairs { trajectory, out_of_order: 0, repeated: 0 })
}

/// The stamps of a `times.txt` beside a file, nanoseconds.
pub(super) fn times_beside(path: &Path) -> Result<Option<Vec<i64>>, LogError> {
    let times = path.with_file_name("times.txt");
    if times == path || !is_file(&times)? {
        return Ok(None);
    }
    let text = read_text(&times, "list of stamps", MAX_STAMPS_BYTES)?;
    parse_times(&text).map(Some).map_err(|e| e.in_file(&times))
}
