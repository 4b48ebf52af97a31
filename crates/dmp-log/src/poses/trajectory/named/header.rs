//! A line that names the columns of a trajectory: which column is what.

use crate::file::{is_header, lines, shorten};
use crate::poses::trajectory::named::names::{
    Meaning, StampName, is_angle, is_number, meaning, surveyed_axis,
};
use crate::{ParseError, PlaceInFile, TimeUnit};

/// Which column is what, by their names.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Header {
    /// The line with the names, from 1; 0 where values show which column is what.
    pub(crate) line: u64,
    pub(crate) names: Vec<String>,
    pub(crate) delimiter: Delimiter,
    pub(crate) stamp: StampColumns,
    pub(crate) place: [usize; 3],
    /// The columns of x, y, z, w; why there are none, where there are places alone.
    pub(crate) quaternion: Result<[usize; 4], String>,
}

/// Where a stamp is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum StampColumns {
    /// In one column, in this unit where its name says so.
    One(usize, Option<TimeUnit>),
    /// None, but a number of the place.
    Number(usize),
    /// Whole seconds, and nanoseconds after them.
    Two(usize, usize),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Delimiter {
    Character(char),
    Blanks,
}

impl Header {
    /// The unit of the stamps, where names have it.
    pub(crate) fn unit(&self) -> Option<TimeUnit> {
        match self.stamp {
            StampColumns::One(_, unit) => unit,
            StampColumns::Two(..) => Some(TimeUnit::Nanoseconds),
            StampColumns::Number(_) => Some(TimeUnit::Seconds),
        }
    }

    /// The columns of a quaternion, of which poses are made.
    pub(crate) fn rotation(&self) -> Result<[usize; 4], ParseError> {
        let place = PlaceInFile::Line(self.line.max(1));
        self.quaternion.clone().map_err(|problem| ParseError::new(place, problem))
    }

    /// Whether the first columns are a stamp in this unit, or one without a name, a place, and a quaternion in this order.
    pub(crate) fn begins_with(&self, unit: TimeUnit, quaternion: [usize; 4]) -> bool {
        let is_stamp = |given: Option<TimeUnit>| given.is_none_or(|given| given == unit);
        matches!(self.stamp, StampColumns::One(0, given) if is_stamp(given))
            && self.place == [1, 2, 3]
            && self.quaternion.as_ref() == Ok(&quaternion)
    }
}

impl Delimiter {
    /// The one that a line of names is parted by.
    pub(super) fn of(line: &str) -> Self {
        [',', ';', '\t'].into_iter().find(|&c| line.contains(c)).map_or(Self::Blanks, Self::Character)
    }

    /// Whether a line ends with it.
    pub(crate) fn is_last(self, line: &str) -> bool {
        matches!(self, Self::Character(c) if self.trimmed(line).ends_with(c))
    }

    /// A line without the blanks at its end, of which a tab that parts columns is none.
    fn trimmed(self, line: &str) -> &str {
        line.trim_end_matches(|c: char| c.is_whitespace() && self != Self::Character(c))
    }

    /// The columns of a line; empty ones count where a character parts them. One at the end does not.
    pub(crate) fn split(self, line: &str) -> Vec<&str> {
        match self {
            Self::Blanks => line.split_ascii_whitespace().collect(),
            Self::Character(c) => {
                let line = self.trimmed(line);
                line.strip_suffix(c).unwrap_or(line).split(c).map(bare).collect()
            }
        }
    }
}

/// A cell without blanks and quotes around it.
fn bare(cell: &str) -> &str {
    let cell = cell.trim();
    cell.strip_prefix('"').and_then(|cell| cell.strip_suffix('"')).map_or(cell, str::trim)
}

/// The line of names of a file: its first line with data, or the comment before that where it names every column.
/// `None` where there is no such line.
pub(crate) fn find(bytes: &[u8]) -> Result<Option<Header>, ParseError> {
    let Some(first) = lines(bytes).next() else { return Ok(None) };
    let PlaceInFile::Line(number) = first?.0 else { return Ok(None) };
    // What stands behind numbers as a comment parts no columns.
    let text = line(bytes, number).and_then(|text| text.split('#').next()).unwrap_or_default();
    if is_header(&Delimiter::of(text).split(text)) {
        return of_line(text, number);
    }
    Ok(of_comment(bytes, number))
}

pub(super) fn line(bytes: &[u8], number: u64) -> Option<&str> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let at = usize::try_from(number).ok()?.checked_sub(1)?;
    std::str::from_utf8(bytes.split(|&c| c == b'\n').nth(at)?).ok()
}

fn of_line(text: &str, number: u64) -> Result<Option<Header>, ParseError> {
    let (delimiter, names) = names(text);
    if names.iter().all(|name| meaning(name).is_none() && surveyed_axis(name).is_none()) {
        return Ok(None);
    }
    let header = assign(number, delimiter, &names);
    header.map(Some).map_err(|problem| ParseError::new(PlaceInFile::Line(number), problem))
}

/// The last comment before the data, where it names as many columns as there are.
fn of_comment(bytes: &[u8], data_at: u64) -> Option<Header> {
    let data = line(bytes, data_at)?;
    let before = bytes.split(|&c| c == b'\n').zip(1..data_at);
    let (comment, number) = before.filter(|(text, _)| !text.trim_ascii().is_empty()).last()?;
    let comment = std::str::from_utf8(comment).ok()?.trim();
    let (_, names) = names(comment.trim_start_matches(['\u{feff}', '#']));
    let data = data.split('#').next().unwrap_or_default();
    // Names may be parted by commas and numbers by blanks; several tabs are one.
    let delimiter = match Delimiter::of(data) {
        Delimiter::Character('\t') => Delimiter::Blanks,
        delimiter => delimiter,
    };
    (delimiter.split(data).len() == names.len()).then(|| assign(number, delimiter, &names).ok()).flatten()
}

fn names(text: &str) -> (Delimiter, Vec<String>) {
    let delimiter = Delimiter::of(text);
    let mut names: Vec<String> = Vec::new();
    for name in delimiter.split(text) {
        match names.last_mut() {
            // `x [m]`, where blanks part names.
            Some(last) if delimiter == Delimiter::Blanks && name.starts_with(['[', '(']) => {
                last.push_str(name);
            }
            _ => names.push(name.to_owned()),
        }
    }
    (delimiter, names)
}

fn assign(line: u64, delimiter: Delimiter, names: &[String]) -> Result<Header, String> {
    let (mut stamps, mut place, mut quaternion) = (Vec::new(), [None; 3], [None; 4]);
    for (column, name) in names.iter().enumerate() {
        let (which, what) = match meaning(name) {
            None => continue,
            Some(Meaning::NotMetres(name)) => {
                return Err(format!("the column `{}`: places are read in metres only", shorten(&name)));
            }
            Some(Meaning::Stamp(stamp)) => {
                stamps.push((column, stamp));
                continue;
            }
            Some(Meaning::Place(axis)) => (&mut place[axis], "place"),
            Some(Meaning::Quaternion(axis)) => (&mut quaternion[axis], "quaternion"),
        };
        if let Some(other) = which.replace(column) {
            let (one, two) = (shorten(&names[other]), shorten(name));
            return Err(format!(
                "the columns `{one}` and `{two}` are the same part of a {what}: leave one out"
            ));
        }
    }
    let lacks = |what: &str, needed: &str| {
        let columns = shorten(&names.join(","));
        format!("no {what} among the columns `{columns}`: {needed}")
    };
    if place.iter().all(Option::is_none) {
        for (column, name) in names.iter().enumerate() {
            if let Some(axis) = surveyed_axis(name) {
                place[axis].get_or_insert(column);
            }
        }
    }
    let [Some(x), Some(y), Some(z)] = place else {
        return Err(lacks("place", "x, y, z must be there"));
    };
    let stamp = stamp_columns(&stamps, names)?;
    let quaternion = match quaternion {
        [Some(qx), Some(qy), Some(qz), Some(qw)] => Ok([qx, qy, qz, qw]),
        _ if names.iter().any(|name| is_angle(name)) => Err(lacks(
            "quaternion",
            "Euler angles are not read, as their order differs from program to program: write qx, qy, qz, qw",
        )),
        _ => Err(lacks("quaternion", "qx, qy, qz, qw must be there, as places alone are no poses")),
    };
    let number = || quaternion.is_err().then(|| names.iter().position(|name| is_number(name))).flatten();
    let stamp = stamp
        .or_else(|| number().map(StampColumns::Number))
        .ok_or_else(|| lacks("stamp", "a column such as timestamp must be there"))?;
    let names = names.to_vec();
    Ok(Header { line, names, delimiter, stamp, place: [x, y, z], quaternion })
}

/// The stamp that is meant: of the lowest rank, of which there must be one.
fn stamp_columns(stamps: &[(usize, StampName)], names: &[String]) -> Result<Option<StampColumns>, String> {
    let Some(rank) = stamps.iter().map(|(_, stamp)| stamp.rank).min() else { return Ok(None) };
    let mut meant = stamps.iter().filter(|(_, stamp)| stamp.rank == rank);
    let (Some((one, first)), second) = (meant.next(), meant.next()) else { return Ok(None) };
    let Some((two, second)) = second else {
        // `rostopic echo -p` writes every stamp in whole nanoseconds.
        let of_rostopic = names.iter().any(|name| name.starts_with("field."));
        let unit = first.unit.or(of_rostopic.then_some(TimeUnit::Nanoseconds));
        return Ok(Some(StampColumns::One(*one, unit)));
    };
    if meant.next().is_none() && first.base == second.base {
        match (first.unit, second.unit) {
            (Some(TimeUnit::Seconds), Some(TimeUnit::Nanoseconds)) => {
                return Ok(Some(StampColumns::Two(*one, *two)));
            }
            (Some(TimeUnit::Nanoseconds), Some(TimeUnit::Seconds)) => {
                return Ok(Some(StampColumns::Two(*two, *one)));
            }
            _ => {}
        }
    }
    let (one, two) = (shorten(&names[*one]), shorten(&names[*two]));
    Err(format!("the columns `{one}` and `{two}` are both stamps: leave one out"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(text: &str) -> Header {
        find(text.as_bytes()).unwrap().unwrap_or_else(|| panic!("{text}"))
    }

    fn refused(names: &str, says: &str) {
        let found = find(format!("{names}\n1,2,3,4,5,6,7,8\n").as_bytes());
        let error = found.and_then(|header| header.unwrap().rotation()).unwrap_err().to_string();
        assert!(error.starts_with("line 1: ") && error.contains(says), "{error}");
    }

    #[test]
    fn columns_have_any_order() {
        let header = found("qw,qx,qy,qz,id,z,y,x,timestamp\n");
        assert_eq!((header.place, header.quaternion), ([7, 6, 5], Ok([1, 2, 3, 0])));
        assert_eq!((header.stamp, header.line), (StampColumns::One(8, None), 1));
        let header = found("\"time [s]\" ; \"x\" ; y;z;qx;qy;qz;qw\n");
        assert_eq!(header.stamp, StampColumns::One(0, Some(TimeUnit::Seconds)));
        assert_eq!(header.delimiter, Delimiter::Character(';'));
        assert_eq!(found("time [ms] x [m] y [m] z [m] qx qy qz qw").names[1], "x[m]");
    }

    #[test]
    fn stamps_of_messages_come_before_those_of_recording() {
        let pose = "field.pose.pose.position.x,field.pose.pose.position.y,field.pose.pose.position.z,\
            field.pose.pose.orientation.x,field.pose.pose.orientation.y,field.pose.pose.orientation.z,\
            field.pose.pose.orientation.w,field.twist.twist.linear.x";
        let header = found(&format!("%time,field.header.seq,field.header.stamp,{pose}\n"));
        assert_eq!(header.stamp, StampColumns::One(2, Some(TimeUnit::Nanoseconds)));
        let header = found(&format!("%time,{pose}\n"));
        assert_eq!(header.stamp, StampColumns::One(0, Some(TimeUnit::Nanoseconds)));
        let header = found("Time,header.stamp.nsecs,header.stamp.secs,x,y,z,qx,qy,qz,qw\n");
        assert_eq!(header.stamp, StampColumns::Two(2, 1));
        assert_eq!(found("secs,nsecs,x,y,z,qx,qy,qz,qw").stamp, StampColumns::Two(0, 1));
    }

    #[test]
    fn a_comment_counts_where_it_names_every_column() {
        let header = found("# run 7\n\n#time tx ty tz qw qx qy qz\n1 2 3 4 1 0 0 0\n");
        assert_eq!((header.quaternion, header.line), (Ok([5, 6, 7, 4]), 3));
        let header = found("#timestamp [ns], tx, ty, tz, qx, qy, qz, qw\n1 2 3 4 0 0 0 1\n");
        assert_eq!(header.delimiter, Delimiter::Blanks);
        let header = found("#t;x;y;z;qx;qy;qz;qw;frame\n0.5;2;3;4;0;0;0;1;map\n0.6;2;3;4;0;0;0;1;\n");
        assert_eq!(header.delimiter, Delimiter::Character(';'));
        let header = found("# time tx ty tz qw qx qy qz\n1\t\t2\t3 4\t1\t0\t0\t0 # a, b\n");
        assert_eq!((header.delimiter, header.quaternion), (Delimiter::Blanks, Ok([5, 6, 7, 4])));
        for text in ["# stamp\n1 2 3 4 0 0 0 1\n", "# t x y z qx qy qz qw\n1 2 3\n", "1 2 3\n", "", "a,b\n"] {
            assert_eq!(find(text.as_bytes()).unwrap(), None, "{text}");
        }
    }

    #[test]
    fn what_lacks_or_is_there_twice_is_named() {
        refused("time,x,y,z", "no quaternion among the columns `time,x,y,z`: qx, qy, qz, qw must be there");
        refused("time,x,y,z,roll,pitch,yaw", "Euler angles are not read");
        refused("GPSTime,easting,northing,altitude,vel_east,roll,pitch,heading", "Euler angles are not read");
        refused("id,e,n,h", "places alone are no poses");
        refused("time,x,y,qx,qy,qz,qw", "no place among");
        refused("x,y,z,qx,qy,qz,qw", "no stamp among");
        refused("time,x,y,z,tx,ty,tz,qx,qy,qz,qw", "the columns `x` and `tx` are the same part of a place");
        refused("time,timestamp,x,y,z,qx,qy,qz,qw", "`time` and `timestamp` are both stamps");
        refused("secs,nsecs,time,x,y,z,qx,qy,qz,qw", "are both stamps");
        refused("time,x [mm],y,z,qx,qy,qz,qw", "`x [mm]`: places are read in metres only");
    }
}
