//! The formats of trajectories, and which one a file has.

use super::described::{described, has_decimal_commas, has_matrix, may_be_quaternion, numbers_of};
use super::{euroc, matrices, npy, redwood};
use crate::file::{lines, shorten};
use crate::logs::{ROS1_ADVICE, ROS1_MAGIC};
use crate::poses::g2o;
use crate::poses::trajectory::named::header;
use crate::{LogError, ParseError, PlaceInFile, TimeUnit};
use dmp_lengths::thousands;
use std::fmt;
use std::path::Path;
use std::str::FromStr;

/// The formats of trajectories.
///
/// As text (`FromStr`, `Display`): `tum`, `kitti`, `euroc`, `npy`, `g2o`, `redwood`,
/// `matrices`, `csv`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum TrajectoryFormat {
    /// Lines of `stamp tx ty tz qx qy qz qw`.
    Tum,
    /// Lines of the twelve numbers of a 3 × 4 matrix.
    Kitti,
    /// Lines of `stamp_ns,x,y,z,qw,qx,qy,qz` and perhaps more columns.
    Euroc,
    /// A `NumPy` array of N × 4 × 4 or N × 3 × 4 numbers.
    Npy,
    /// The vertices of a pose graph: `VERTEX_SE3:QUAT id x y z qx qy qz qw`, `VERTEX_SE2 id x y theta`.
    G2o,
    /// A line of three whole numbers and four of a 4 × 4 matrix for each pose.
    RedwoodLog,
    /// Lines of `stamp` and the numbers of a 3 × 4 or 4 × 4 matrix.
    Matrices,
    /// Lines with columns in any order, and a line with their names.
    Csv,
}

impl TrajectoryFormat {
    /// Every format.
    pub const ALL: [Self; 8] = [
        Self::Tum,
        Self::Kitti,
        Self::Euroc,
        Self::Npy,
        Self::G2o,
        Self::RedwoodLog,
        Self::Matrices,
        Self::Csv,
    ];

    /// Its name for people, and as it is written.
    fn names(self) -> (&'static str, &'static str) {
        match self {
            Self::Tum => ("TUM", "tum"),
            Self::Kitti => ("KITTI", "kitti"),
            Self::Euroc => ("EuRoC", "euroc"),
            Self::Npy => ("NumPy", "npy"),
            Self::G2o => ("g2o", "g2o"),
            Self::RedwoodLog => ("Redwood .log", "redwood"),
            Self::Matrices => ("stamped matrices", "matrices"),
            Self::Csv => ("csv", "csv"),
        }
    }

    /// Its name for people.
    pub fn name(self) -> &'static str {
        self.names().0
    }

    /// Whether its poses have stamps of their own.
    pub fn has_stamps(self) -> bool {
        matches!(self, Self::Tum | Self::Euroc | Self::Matrices | Self::Csv)
    }
}

impl fmt::Display for TrajectoryFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.names().1)
    }
}

impl FromStr for TrajectoryFormat {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|format| format.to_string() == text);
        found.ok_or_else(|| {
            let words = Self::ALL.map(|format| format.to_string()).join(", ");
            format!("`{}` is no format of trajectories: they are {words}", shorten(text))
        })
    }
}

/// The format of a file: an array by its first bytes, text by its first line with data.
pub(super) fn find_format(path: &Path, bytes: &[u8]) -> Result<TrajectoryFormat, LogError> {
    if bytes.starts_with(npy::MAGIC) {
        return Ok(TrajectoryFormat::Npy);
    }
    if bytes.starts_with(ROS1_MAGIC) {
        return Err(LogError::UnknownFormat { path: path.into(), looked_for: ROS1_ADVICE.into() });
    }
    let Some(first) = lines(bytes).next() else {
        return Err(no_poses(bytes).in_file(path));
    };
    let (place, columns) = first.map_err(|e| e.in_file(path))?;
    let word = columns.first().copied().unwrap_or_default();
    let refuse = |problem: String| Err(LogError::malformed(path, place, problem));
    if line_at(bytes, place).is_some_and(|line| has_decimal_commas(&String::from_utf8_lossy(line))) {
        return refuse("numbers with decimal commas: write them with points, as 0.5".to_owned());
    }
    if g2o::is_tag(word) {
        return Ok(TrajectoryFormat::G2o);
    }
    let is_euroc = is_euroc(bytes, place, &columns);
    if let Some(header) = header::find(bytes).map_err(|e| e.in_file(path))? {
        // A comment that names what the format has anyway says nothing new.
        let says_nothing = match (is_euroc, columns.len()) {
            (true, _) => header.begins_with(TimeUnit::Nanoseconds, [5, 6, 7, 4]),
            (false, 8) => header.begins_with(TimeUnit::Seconds, [4, 5, 6, 7]),
            _ => false,
        };
        if !says_nothing || crate::file::is_header(&columns) {
            return Ok(TrajectoryFormat::Csv);
        }
    }
    // The number of columns alone says little: their values must be possible.
    let numbers = numbers_of(&columns).unwrap_or_default();
    let has_quaternion = numbers
        .get(4..8)
        .is_none_or(|quaternion| numbers.len() < columns.len() || may_be_quaternion(quaternion));
    if matrices::is_line(&columns) {
        return Ok(TrajectoryFormat::Matrices);
    }
    if is_euroc && has_quaternion {
        return Ok(TrajectoryFormat::Euroc);
    }
    if redwood::is_head(&columns) {
        return Ok(TrajectoryFormat::RedwoodLog);
    }
    match columns.len() {
        8 if has_quaternion => Ok(TrajectoryFormat::Tum),
        12 => Ok(TrajectoryFormat::Kitti),
        16 if has_matrix(&numbers, 0) => Ok(TrajectoryFormat::Kitti),
        13 | 17 if has_matrix(&numbers, 1) => refuse(format!(
            "{} columns: a frame number and a matrix. Frames may be missing, so write the stamp of each frame in the place of its \
             number",
            columns.len()
        )),
        _ => refuse(format!(
            "{}. This is neither TUM (stamp tx ty tz qx qy qz qw) nor EuRoC (stamp_ns,x,y,z,qw,qx,qy,qz) nor KITTI (12 numbers) nor \
             a stamp and a matrix, g2o, Redwood or .npy: name the columns in a first line, as timestamp,tx,ty,tz,qx,qy,qz,qw",
            described(&columns)
        )),
    }
}

/// The bytes of a line.
fn line_at(bytes: &[u8], place: PlaceInFile) -> Option<&[u8]> {
    let PlaceInFile::Line(number) = place else { return None };
    bytes.split(|&c| c == b'\n').nth(usize::try_from(number).ok()?.checked_sub(1)?)
}

pub(super) fn no_poses(bytes: &[u8]) -> ParseError {
    ParseError::new(PlaceInFile::WholeFile, format!("no poses in {} bytes", thousands(bytes.len())))
}

/// Whether the lines are EuRoC's: parted by commas, and stamps in nanoseconds, by the heading (`[ns]`) or
/// by their digits (TUM's seconds since 1970 have ten before the point).
fn is_euroc(bytes: &[u8], place: PlaceInFile, columns: &[&str]) -> bool {
    let PlaceInFile::Line(number) = place else { return false };
    let count = usize::try_from(number).unwrap_or(usize::MAX);
    let mut commented = bytes.split(|&c| c == b'\n').take(count);
    let line = commented.clone().last().unwrap_or_default();
    let mut in_ns = || commented.any(|line| line.starts_with(b"#") && line.windows(4).any(|w| w == b"[ns]"));
    let whole = |stamp: &&str| stamp.len() >= 15 && stamp.bytes().all(|c| c.is_ascii_digit());
    columns.len() >= euroc::COLUMNS && line.contains(&b',') && (columns.first().is_some_and(whole) || in_ns())
}
