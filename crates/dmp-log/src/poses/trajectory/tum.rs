//! Trajectories as TUM has them, read and written.

use dmp_sensor::{Isometry3, Trajectory, TrajectoryRepairs};

use super::error::TrajectoryParseError;
use crate::file::columns::numbers;
use crate::file::{lines, ns_to_seconds, pose_of, to_ns};
use crate::{ParseError, PlaceInFile, TimeUnit};
use std::io::{self, Write};

/// Parses the TUM format: lines of `stamp tx ty tz qx qy qz qw`, `world_from_body`. Stamps are read to
/// the nanosecond; quaternions within 10 % of unit length are normalised.
///
/// # Errors
/// In the first line that has another number of columns, something that is no finite number, a
/// quaternion that is no rotation, a position 10⁸ m away; and as [`Trajectory::stamped`].
pub fn parse_tum(bytes: &[u8]) -> Result<TrajectoryRepairs, TrajectoryParseError> {
    parse_tum_in(bytes, TimeUnit::Seconds)
}

/// The same with stamps in this unit.
pub(super) fn parse_tum_in(bytes: &[u8], unit: TimeUnit) -> Result<TrajectoryRepairs, TrajectoryParseError> {
    let mut poses = Vec::new();
    for line in lines(bytes) {
        let (place, columns) = line?;
        poses.push(parse_line(place, &columns, unit)?);
    }
    Ok(Trajectory::stamped(poses)?)
}

fn parse_line(
    place: PlaceInFile,
    columns: &[&str],
    unit: TimeUnit,
) -> Result<(i64, Isometry3<f64>), ParseError> {
    let [_, tx, ty, tz, qx, qy, qz, qw] = numbers::<8>(place, columns, "stamp tx ty tz qx qy qz qw")?;
    let stamp = columns.first().copied().unwrap_or_default();
    let stamp_ns = to_ns(stamp, unit).map_err(|problem| ParseError::new(place, problem))?;
    Ok((stamp_ns, pose_of(place, [tx, ty, tz], [qx, qy, qz, qw])?))
}

/// Writes the TUM format; [`parse_tum`] gives the same stamps and places back.
///
/// # Errors
/// When the trajectory has no stamps (`InvalidInput`), or as `out` does.
///
/// ```
/// use dmp_sensor::{Isometry3, Trajectory};
///
/// let run = Trajectory::stamped(vec![(1_500_000_000, Isometry3::translation(2.0, 0.0, 0.5))])?.trajectory;
/// let mut file = Vec::new();
/// dmp_log::write_tum(&mut file, &run)?;
/// assert!(file.ends_with(b"\n1.500000000 2 0 0.5 0 0 0 1\n"));
/// assert_eq!(dmp_log::parse_tum(&file)?.trajectory, run);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn write_tum(out: &mut impl Write, trajectory: &Trajectory) -> io::Result<()> {
    let Some(stamps_ns) = trajectory.stamps_ns() else {
        let problem = "the TUM format needs stamps, and the trajectory has none";
        return Err(io::Error::new(io::ErrorKind::InvalidInput, problem));
    };
    write_tum_poses(out, stamps_ns.iter().copied().zip(trajectory.poses().iter().copied()))
}

/// Writes the TUM format pose by pose, so that none need be held: stamps in nanoseconds, which ascend, and
/// `world_from_body`.
///
/// # Errors
/// As `out` does.
pub fn write_tum_poses(
    out: &mut impl Write,
    poses: impl IntoIterator<Item = (i64, Isometry3<f64>)>,
) -> io::Result<()> {
    writeln!(out, "# timestamp tx ty tz qx qy qz qw")?;
    for (stamp_ns, pose) in poses {
        let [tx, ty, tz] = pose.translation.vector.into();
        let [qx, qy, qz, qw]: [f64; 4] = pose.rotation.coords.into();
        writeln!(out, "{} {tx} {ty} {tz} {qx} {qy} {qz} {qw}", ns_to_seconds(stamp_ns))?;
    }
    Ok(())
}
