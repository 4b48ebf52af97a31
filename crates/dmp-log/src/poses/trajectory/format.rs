//! The formats of trajectories, and which one a file has.

use super::{euroc, npy, redwood};
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
/// As text (`FromStr`, `Display`): `tum`, `kitti`, `euroc`, `npy`, `g2o`, `redwood`, `csv`.
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
    /// Lines with columns in any order, and a line with their names.
    Csv,
}

impl TrajectoryFormat {
    /// Every format.
    pub const ALL: [Self; 7] =
        [Self::Tum, Self::Kitti, Self::Euroc, Self::Npy, Self::G2o, Self::RedwoodLog, Self::Csv];

    /// Its name for people, and as it is written.
    fn names(self) -> (&'static str, &'static str) {
        match self {
            Self::Tum => ("TUM", "tum"),
            Self::Kitti => ("KITTI", "kitti"),
            Self::Euroc => ("EuRoC", "euroc"),
            Self::Npy => ("NumPy", "npy"),
            Self::G2o => ("g2o", "g2o"),
            Self::RedwoodLog => ("Redwood .log", "redwood"),
            Self::Csv => ("csv", "csv"),
        }
    }

    /// Its name for people.
    pub fn name(self) -> &'static str {
        self.names().0
    }

    /// Whether its poses have stamps of their own.
    pub fn has_stamps(self) -> bool {
        matches!(self, Self::Tum | Self::Euroc | Self::Csv)
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
    if is_euroc {
        return Ok(TrajectoryFormat::Euroc);
    }
    if redwood::is_head(&columns) {
        return Ok(TrajectoryFormat::RedwoodLog);
    }
    match columns.len() {
        8 => Ok(TrajectoryFormat::Tum),
        12 => Ok(TrajectoryFormat::Kitti),
        count => {
            let problem = format!(
                "{count} columns starting with `{}`: neither TUM (8: stamp tx ty tz qx qy qz qw) nor KITTI (12) \
                nor EuRoC (8 or more with commas: stamp_ns,x,y,z,qw,qx,qy,qz) nor g2o (VERTEX_SE3:QUAT …) nor Redwood (0 0 1 and four rows) nor .npy \
                nor columns with names (timestamp,tx,ty,tz,qx,qy,qz,qw)",
                shorten(word)
            );
            Err(LogError::malformed(path, place, problem))
        }
    }
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
