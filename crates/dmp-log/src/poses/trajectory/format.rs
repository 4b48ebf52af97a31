//! The formats of trajectories, and which one a file has.

use super::described::{described, has_decimal_commas, has_matrix, may_be_quaternion, numbers_of};
use super::{euroc, matrices, npy, redwood};
use crate::file::{lines, shorten, unit_since_1970};
use crate::logs::{ROS1_ADVICE, ROS1_MAGIC};
use crate::poses::g2o;
use crate::poses::trajectory::named::{find_by_values, header};
use crate::{LogError, ParseError, PlaceInFile, TimeUnit};
use dmp_lengths::thousands;
use std::fmt;
use std::path::Path;
use std::str::FromStr;

/// The formats of trajectories.
///
/// As text (`FromStr`, `Display`): `tum`, `kitti`, `euroc`, `npy`, `g2o`, `redwood`,
/// `matrices`, `numbered`, `csv`.
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
    /// Lines of the number of a frame and the numbers of a 3 × 4 or 4 × 4 matrix.
    Numbered,
    /// Lines with columns in any order: by a line with their names, or by their values where these leave one reading.
    Csv,
}

/// Fewer lines may be in any order.
const FEW_STEPS: usize = 8;
/// A first column that falls more often than at one of so many steps is no stamp.
const FALLS_OF_STEPS: usize = 4;

impl TrajectoryFormat {
    /// Every format.
    pub const ALL: [Self; 9] = [
        Self::Tum,
        Self::Kitti,
        Self::Euroc,
        Self::Npy,
        Self::G2o,
        Self::RedwoodLog,
        Self::Matrices,
        Self::Numbered,
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
            Self::Numbered => ("numbered matrices", "numbered"),
            Self::Csv => ("csv", "csv"),
        }
    }

    /// Its name for people.
    pub fn name(self) -> &'static str {
        self.names().0
    }

    /// The same where stamps have a unit: then the first numbers count no frames.
    pub(super) fn with_stamps_in(self, unit: Option<TimeUnit>) -> Self {
        if self == Self::Numbered && unit.is_some() { Self::Matrices } else { self }
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

/// The format of a file: an array by its first bytes, text by its first line with data. Numbers without names are stamps only if
/// they rise.
pub(super) fn find_format(path: &Path, bytes: &[u8]) -> Result<TrajectoryFormat, LogError> {
    let format = by_start(path, bytes)?;
    let is_stamped = matches!(
        format,
        TrajectoryFormat::Tum
            | TrajectoryFormat::Euroc
            | TrajectoryFormat::Matrices
            | TrajectoryFormat::Numbered
    );
    match falling(bytes).filter(|_| is_stamped) {
        Some((place, problem)) => Err(LogError::malformed(path, place, problem)),
        None => Ok(format),
    }
}

/// Where the first column first falls, if it falls so often that it is no stamp.
fn falling(bytes: &[u8]) -> Option<(PlaceInFile, String)> {
    let (mut steps, mut falls, mut first, mut last) = (0_usize, 0_usize, None, None);
    for line in lines(bytes) {
        // What is wrong in a line is reported where it is parsed.
        let (place, columns) = line.ok()?;
        let stamp = columns.first()?.parse::<f64>().ok()?;
        if let Some(before) = last.replace(stamp) {
            steps += 1;
            if stamp < before {
                falls += 1;
                first.get_or_insert((place, before, stamp));
            }
        }
    }
    let (place, before, stamp) = first?;
    let is_time = unit_since_1970(before).is_some() && unit_since_1970(stamp).is_some();
    (!is_time && steps >= FEW_STEPS && FALLS_OF_STEPS * falls > steps).then(|| {
        let problem = format!(
            "column 1 falls from {before} to {stamp}, and in {} of {} lines: no stamps. Name the columns in a first line, as \
             timestamp,tx,ty,tz,qx,qy,qz,qw",
            thousands(falls),
            thousands(steps)
        );
        (place, problem)
    })
}

fn by_start(path: &Path, bytes: &[u8]) -> Result<TrajectoryFormat, LogError> {
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
    // Four columns would do for a stamp and a place.
    let rows = lines(bytes).take(3).filter_map(Result::ok).filter(|(_, row)| row.len() == 4);
    if has_matrix(&rows.filter_map(|(_, row)| numbers_of(&row)).flatten().collect::<Vec<_>>(), 0) {
        return refuse(
            "the rows of a matrix, a line each: write each matrix in one line, 12 numbers".to_owned(),
        );
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
    if let Some(is_frame) = matrices::is_line(&columns) {
        return Ok(if is_frame { TrajectoryFormat::Numbered } else { TrajectoryFormat::Matrices });
    }
    if is_euroc && has_quaternion {
        return Ok(TrajectoryFormat::Euroc);
    }
    if redwood::is_head(&columns) {
        return Ok(TrajectoryFormat::RedwoodLog);
    }
    match columns.len() {
        8 if has_quaternion => Ok(TrajectoryFormat::Tum),
        12 | 16 if has_matrix(&numbers, 0) => Ok(TrajectoryFormat::Kitti),
        _ if find_by_values(bytes).is_some() => Ok(TrajectoryFormat::Csv),
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
