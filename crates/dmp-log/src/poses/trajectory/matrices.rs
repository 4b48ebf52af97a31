//! Trajectories with a stamp, or the number of a frame, and a matrix in each line.

use dmp_lengths::thousands;
use dmp_sensor::{Isometry3, Trajectory, TrajectoryRepairs};

use super::described::{has_matrix, is_frame, numbers_of};
use super::error::TrajectoryParseError;
use super::{kitti, stamps};
use crate::file::{lines, pose_of_rows, shorten, to_ns};
use crate::{LogError, ParseError, PlaceInFile, TimeUnit};
use std::path::Path;

/// Whether a line has a first column and the 12 numbers of a 3 × 4 matrix or the 16 of a 4 × 4 one, by their values; and whether
/// that first column is the number of a frame rather than a stamp.
pub(super) fn is_line(columns: &[&str]) -> Option<bool> {
    let numbers = numbers_of(columns).filter(|numbers| [13, 17].contains(&numbers.len()))?;
    has_matrix(&numbers, 1).then(|| is_frame(numbers[0]))
}

/// The stamp of a line as written, and its rows.
pub(super) fn row<'a>(place: PlaceInFile, columns: &[&'a str]) -> Result<(&'a str, [f64; 12]), ParseError> {
    let (stamp, rest) =
        columns.split_first().ok_or_else(|| ParseError::new(place, "the line is empty".to_owned()))?;
    Ok((stamp, kitti::row(place, rest)?))
}

/// Parses lines of a stamp in this unit and the numbers of `[R t]`, or of the 4 × 4 matrix, row by row, `world_from_body`.
pub(super) fn parse_matrices_in(
    bytes: &[u8],
    unit: TimeUnit,
) -> Result<TrajectoryRepairs, TrajectoryParseError> {
    let mut poses = Vec::new();
    for line in lines(bytes) {
        let (place, columns) = line?;
        let (stamp, rows) = row(place, &columns)?;
        let stamp_ns = to_ns(stamp, unit).map_err(|problem| ParseError::new(place, problem))?;
        poses.push((stamp_ns, pose_of_rows(place, rows)?));
    }
    Ok(Trajectory::stamped(poses)?)
}

/// Reads lines of the number of a frame, from 0, and the numbers of `[R t]` or of the 4 × 4 matrix. A `times.txt` beside the file
/// has the stamp of every frame; without it no frame may be missing, and the n-th pose belongs to the n-th scan.
pub(super) fn read_numbered(
    path: &Path,
    bytes: &[u8],
    notes: &mut Vec<String>,
) -> Result<TrajectoryRepairs, LogError> {
    let (mut poses, mut gap) = (Vec::new(), None);
    for line in lines(bytes) {
        let (place, columns) = line.map_err(|e| e.in_file(path))?;
        let (frame, pose) = numbered(place, &columns).map_err(|e| e.in_file(path))?;
        if frame != poses.len() {
            gap.get_or_insert((place, poses.last().map(|&(frame, _)| frame), frame));
        }
        poses.push((frame, pose));
    }
    let in_file = |source| LogError::Trajectory { path: path.to_owned(), source };
    if let Some(stamps_ns) = stamps::times_beside(path)? {
        let stamped: Option<Vec<_>> =
            poses.iter().map(|&(frame, pose)| Some((*stamps_ns.get(frame)?, pose))).collect();
        if let Some(stamped) = stamped {
            notes.push(format!(
                "stamps from line n + 1 of times.txt for frame n, of {}",
                thousands(stamps_ns.len())
            ));
            return Trajectory::stamped(stamped).map_err(in_file);
        }
    }
    if let Some((place, before, frame)) = gap {
        let problem = match before {
            Some(before) => format!("frame {frame} follows frame {before}"),
            None => format!("the first frame is {frame}"),
        };
        let problem = format!(
            "{problem}: where frames are missing, poses have no scans line by line. Put a times.txt with the stamp of every frame \
             from 0 beside the file, or write stamps in the place of the numbers"
        );
        return Err(LogError::malformed(path, place, problem));
    }
    notes.push(
        "no stamps: column 1 counts the frames from 0; the n-th pose belongs to the n-th scan".to_owned(),
    );
    let trajectory =
        Trajectory::unstamped(poses.into_iter().map(|(_, pose)| pose).collect()).map_err(in_file)?;
    Ok(TrajectoryRepairs { trajectory, out_of_order: 0, repeated: 0 })
}

fn numbered(place: PlaceInFile, columns: &[&str]) -> Result<(usize, Isometry3<f64>), ParseError> {
    let (number, rows) = row(place, columns)?;
    let frame = number.parse().map_err(|_| {
        ParseError::new(
            place,
            format!("`{}` is no number of a frame, as the first line has", shorten(number)),
        )
    })?;
    Ok((frame, pose_of_rows(place, rows)?))
}
