//! Trajectories whose columns have names.

use dmp_sensor::{Trajectory, TrajectoryRepairs};

use crate::file::{data_of, found_or, pose_of, shorten, to_ns};
use crate::poses::trajectory::error::TrajectoryParseError;
use crate::poses::trajectory::named::header::{Header, StampColumns};
use crate::poses::trajectory::named::{by_values, header};
use crate::{ParseError, PlaceInFile, TimeUnit};

/// A line: its numbers, all finite.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Row<'a> {
    pub(crate) place: PlaceInFile,
    pub(crate) stamp: RowStamp<'a>,
    pub(crate) position_m: [f64; 3],
    /// x, y, z, w; places may be alone.
    pub(crate) quaternion: Option<[f64; 4]>,
}

/// The stamp of a line.
#[derive(Debug, Clone, Copy)]
pub(crate) enum RowStamp<'a> {
    /// As it is written, which is a number, and as that.
    One(&'a str, f64),
    /// Seconds, and nanoseconds below a second.
    Two(i64, i64),
}

impl RowStamp<'_> {
    fn in_ns(self, unit: TimeUnit) -> Result<i64, String> {
        match self {
            Self::One(text, _) => to_ns(text, unit),
            Self::Two(seconds, ns) => seconds
                .checked_mul(1_000_000_000)
                .and_then(|whole| whole.checked_add(ns))
                .ok_or_else(|| format!("a stamp of {seconds} s is beyond the years 1677 to 2262")),
        }
    }

    /// Rounded once, as others do.
    pub(crate) fn in_s(self, unit: TimeUnit) -> f64 {
        match self {
            Self::One(_, stamp) => stamp / (1e9 / unit.in_ns() as f64),
            Self::Two(seconds, ns) => seconds as f64 + ns as f64 * 1e-9,
        }
    }
}

/// Which column is what, by a line of names, or else by the values.
pub(crate) fn header_of(bytes: &[u8]) -> Result<Header, ParseError> {
    header::find(bytes)?.or_else(|| by_values::find(bytes)).ok_or_else(|| {
        let problem = "no line with the names of columns, such as timestamp,tx,ty,tz,qx,qy,qz,qw";
        ParseError::new(PlaceInFile::WholeFile, problem)
    })
}

/// Parses lines whose columns are named by a line before them, in any order: a stamp (`timestamp`, `time_ns`, `secs` and
/// `nsecs`, `field.header.stamp` …), a place (`x`, `tx`, `position.x`, `p_RS_R_x [m]` …) and a quaternion (`qx`,
/// `orientation.x`, `q_RS_w []` …); others are not used. `world_from_body`, in metres. Notes say what was taken for what.
pub(crate) fn parse_csv_in(
    bytes: &[u8],
    unit: Option<TimeUnit>,
    notes: &mut Vec<String>,
) -> Result<TrajectoryRepairs, TrajectoryParseError> {
    let header = header_of(bytes)?;
    header.rotation()?;
    let unit = unit_in(bytes, &header, unit.or(header.unit()), None, notes)?;
    let mut poses = Vec::new();
    for_each_row(bytes, &header, |row| {
        let stamp_ns = row.stamp.in_ns(unit).map_err(|problem| ParseError::new(row.place, problem))?;
        poses.push((stamp_ns, pose_of(row.place, row.position_m, row.quaternion.unwrap_or_default())?));
        Ok(())
    })?;
    Ok(Trajectory::stamped(poses)?)
}

/// The unit of the stamps: the one that is known, or else the one that is found, or `otherwise`. Notes say so.
pub(crate) fn unit_in(
    bytes: &[u8],
    header: &Header,
    known: Option<TimeUnit>,
    otherwise: Option<TimeUnit>,
    notes: &mut Vec<String>,
) -> Result<TimeUnit, ParseError> {
    let unit = if let Some(unit) = known {
        unit
    } else {
        let (mut stamps, mut first) = (Vec::new(), None);
        for_each_row(bytes, header, |row| {
            first.get_or_insert(row.place);
            stamps.push(row.stamp.in_s(TimeUnit::Seconds));
            Ok(())
        })?;
        found_or(otherwise, &stamps, first.unwrap_or(PlaceInFile::WholeFile), notes)?
    };
    let stamp = match header.stamp {
        StampColumns::One(column, _) | StampColumns::Number(column) => vec![column],
        StampColumns::Two(seconds, ns) => vec![seconds, ns],
    };
    let quaternion = header.quaternion.as_ref().map_or(&[][..], |columns| columns);
    let used = stamp.iter().chain(&header.place).chain(quaternion);
    let names: Vec<String> = used.map(|&column| shorten(&header.names[column])).collect();
    let stamps = match header.stamp {
        StampColumns::One(..) => format!("stamps in {}", unit.name()),
        StampColumns::Two(..) => "stamps in seconds and nanoseconds".to_owned(),
        StampColumns::Number(_) => "no stamps: places with the same number are one".to_owned(),
    };
    let names = names.join(", ");
    notes.push(match header.line {
        0 => format!("no names of columns; by the values: {names}; {stamps}"),
        line => format!("columns by the names in line {line}: {names}; {stamps}"),
    });
    if header.quaternion.is_err() {
        notes.push("places alone: rotations are not compared".to_owned());
    }
    Ok(unit)
}

/// Hands over the lines behind that of the names.
pub(crate) fn for_each_row(
    bytes: &[u8],
    header: &Header,
    mut each: impl FnMut(Row<'_>) -> Result<(), ParseError>,
) -> Result<(), ParseError> {
    let behind = usize::try_from(header.line).unwrap_or(usize::MAX);
    for (line, line_number) in bytes.split(|&c| c == b'\n').zip(1..).skip(behind) {
        let place = PlaceInFile::Line(line_number);
        let text = data_of(line, place)?;
        if text.trim().is_empty() {
            continue;
        }
        let mut cells = header.delimiter.split(text);
        // An empty cell at the end looks like a delimiter behind the last one.
        if cells.len() + 1 == header.names.len() && header.delimiter.is_last(text) {
            cells.push("");
        }
        if cells.len() != header.names.len() {
            let (found, expected, names) = (cells.len(), header.names.len(), header.line);
            let problem = match names {
                0 => format!("{found} columns, expected {expected} as in the first line: is the line cut?"),
                names => format!("{found} columns, line {names} names {expected}: is the line cut?"),
            };
            return Err(ParseError::new(place, problem));
        }
        let number = |column: usize| number(place, &header.names[column], cells[column]);
        let stamp = match header.stamp {
            StampColumns::One(column, _) | StampColumns::Number(column) => {
                RowStamp::One(cells[column], number(column)?)
            }
            StampColumns::Two(seconds, ns) => {
                let [seconds, ns] =
                    [seconds, ns].map(|column| whole(place, &header.names[column], cells[column]));
                let (seconds, ns) = (seconds?, ns?);
                if !(0..1_000_000_000).contains(&ns) {
                    let problem = format!("{ns} nanoseconds after a second are none of it");
                    return Err(ParseError::new(place, problem));
                }
                RowStamp::Two(seconds, ns)
            }
        };
        let [x, y, z] = header.place;
        let quaternion = match header.quaternion {
            Ok([qx, qy, qz, qw]) => Some([number(qx)?, number(qy)?, number(qz)?, number(qw)?]),
            Err(_) => None,
        };
        each(Row { place, stamp, position_m: [number(x)?, number(y)?, number(z)?], quaternion })?;
    }
    Ok(())
}

fn number(place: PlaceInFile, name: &str, cell: &str) -> Result<f64, ParseError> {
    let problem = match cell.parse::<f64>() {
        Ok(number) if number.is_finite() => return Ok(number),
        Ok(_) => "is not finite",
        Err(_) => "is not a number",
    };
    Err(ParseError::new(place, format!("`{}` in the column `{}` {problem}", shorten(cell), shorten(name))))
}

fn whole(place: PlaceInFile, name: &str, cell: &str) -> Result<i64, ParseError> {
    cell.parse().map_err(|_| {
        let problem = format!("`{}` in the column `{}` is no whole number", shorten(cell), shorten(name));
        ParseError::new(place, problem)
    })
}
