//! Trajectories as EuRoC has them, read and written.

use dmp_sensor::{Trajectory, TrajectoryRepairs};

use super::error::TrajectoryParseError;
use crate::file::{lines, pose_of, shorten, to_ns, values};
use crate::{ParseError, PlaceInFile, TimeUnit};
use std::io::{self, Write};

/// Columns that are used; velocities and biases may follow.
pub(super) const COLUMNS: usize = 8;

/// Parses the ground truth format of EuRoC: lines of `stamp_ns,x,y,z,qw,qx,qy,qz` and perhaps more columns,
/// which are not used; `world_from_body`. Quaternions within 10 % of unit length are normalised.
///
/// # Errors
/// In the first line that has fewer or other columns than the first, a stamp that is no whole number of
/// nanoseconds, and as [`parse_tum`](super::parse_tum).
pub fn parse_euroc(bytes: &[u8]) -> Result<TrajectoryRepairs, TrajectoryParseError> {
    parse_euroc_in(bytes, TimeUnit::Nanoseconds)
}

/// The same with stamps in this unit.
pub(super) fn parse_euroc_in(
    bytes: &[u8],
    unit: TimeUnit,
) -> Result<TrajectoryRepairs, TrajectoryParseError> {
    let mut poses = Vec::new();
    let mut width = None;
    for line in lines(bytes) {
        let (place, columns) = line?;
        let values = row(place, &columns, &mut width)?;
        let stamp = columns.first().copied().unwrap_or_default();
        let stamp_ns = match unit {
            TimeUnit::Nanoseconds => stamp
                .parse::<i64>()
                .map_err(|_| format!("the stamp `{}` is no whole number of nanoseconds", shorten(stamp))),
            unit => to_ns(stamp, unit),
        };
        let stamp_ns = stamp_ns.map_err(|problem| ParseError::new(place, problem))?;
        let [_, x, y, z, qw, qx, qy, qz] = values;
        poses.push((stamp_ns, pose_of(place, [x, y, z], [qx, qy, qz, qw])?));
    }
    Ok(Trajectory::stamped(poses)?)
}

/// The used columns of a line; all lines must have as many as the first.
pub(super) fn row(
    place: PlaceInFile,
    columns: &[&str],
    width: &mut Option<usize>,
) -> Result<[f64; COLUMNS], ParseError> {
    let expected = *width.get_or_insert(columns.len());
    if columns.len() != expected || columns.len() < COLUMNS {
        let problem = format!(
            "{} columns, expected {} (stamp_ns,x,y,z,qw,qx,qy,qz and the state): is the line cut?",
            columns.len(),
            expected.max(COLUMNS)
        );
        return Err(ParseError::new(place, problem));
    }
    values(place, columns)
}

/// Writes the ground truth format of EuRoC, with the heading of the dataset and without the state behind
/// the pose; [`parse_euroc`] gives the same stamps and places back.
///
/// # Errors
/// When the trajectory has no stamps (`InvalidInput`), or as `out` does.
pub fn write_euroc(out: &mut impl Write, trajectory: &Trajectory) -> io::Result<()> {
    let Some(stamps_ns) = trajectory.stamps_ns() else {
        let problem = "the EuRoC format needs stamps, and the trajectory has none";
        return Err(io::Error::new(io::ErrorKind::InvalidInput, problem));
    };
    writeln!(
        out,
        "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []"
    )?;
    for (&stamp_ns, pose) in stamps_ns.iter().zip(trajectory.poses()) {
        let [x, y, z] = pose.translation.vector.into();
        let [qx, qy, qz, qw]: [f64; 4] = pose.rotation.coords.into();
        writeln!(out, "{stamp_ns},{x},{y},{z},{qw},{qx},{qy},{qz}")?;
    }
    Ok(())
}
