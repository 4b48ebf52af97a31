//! Which column is what in tables of poses without names, where the values leave one reading.

use super::header::{Delimiter, Header, StampColumns, line};
use crate::file::{data_of, lines, unit_since_1970};
use crate::poses::trajectory::described::{is_frame, may_be_quaternion};
use crate::{PlaceInFile, TimeUnit};

/// Nanoseconds are fewer than these.
const SECOND_NS: f64 = 1e9;
/// Names of frames that a message has in front of its pose.
const MOST_NAMES: usize = 2;
const NO_ROTATION: &str = "there is a stamp and a place and no quaternion: places alone are no poses";
const ANGLES: &str = "there is a stamp, a place and perhaps Euler angles, which are not read, as their order differs \
                      from program to program: write stamp tx ty tz qx qy qz qw";

/// A reading of a table: where the stamp and the place are, and the quaternion behind the place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Reading {
    stamp: StampColumns,
    place: usize,
    rotation: Result<usize, &'static str>,
}

/// The one reading of a table in which all of its lines make sense; `None` where there is none, or several.
pub(crate) fn find(bytes: &[u8]) -> Option<Header> {
    let PlaceInFile::Line(number) = lines(bytes).next()?.ok()?.0 else { return None };
    let text = line(bytes, number)?.split('#').next()?;
    let delimiter = match Delimiter::of(text) {
        // Several tabs are one.
        Delimiter::Character('\t') => Delimiter::Blanks,
        delimiter => delimiter,
    };
    let first = delimiter.split(text);
    let mut readings = readings(&first);
    // What only the first line allows is named where a later line breaks it.
    if readings.len() > 1 {
        readings.retain(|reading| reading.fits(bytes, delimiter, first.len()));
    }
    let &[reading] = readings.as_slice() else { return None };
    Some(reading.header(delimiter, first.len()))
}

/// The readings that a line allows.
fn readings(cells: &[&str]) -> Vec<Reading> {
    let number = |at: usize| cells.get(at)?.parse::<f64>().ok().filter(|number| number.is_finite());
    let is_whole = |at: usize| cells.get(at).is_some_and(|cell| cell.parse::<u64>().is_ok());
    let is_since_1970 = |at: usize| number(at).is_some_and(|stamp| unit_since_1970(stamp).is_some());
    let has_pose = |place: usize| {
        let numbers: Option<Vec<f64>> = (place..place + 7).map(number).collect();
        numbers.is_some_and(|numbers| may_be_quaternion(&numbers[3..]) && numbers[3..] != [0.0; 4])
    };
    let one = |column: usize| StampColumns::One(column, None);
    let pose = |stamp, place: usize| Reading { stamp, place, rotation: Ok(place + 3) };
    let mut found = Vec::new();
    // Messages, as `ros2 topic echo --csv` writes them: a stamp in two numbers, frames, a pose, perhaps covariances.
    let names = cells.iter().skip(2).take_while(|cell| cell.parse::<f64>().is_err()).count();
    let is_stamp = is_whole(0) && is_whole(1) && number(1).is_some_and(|ns| ns < SECOND_NS);
    let is_date = number(0).is_some_and(|stamp| unit_since_1970(stamp) == Some(TimeUnit::Seconds));
    let has_frames = (1..=MOST_NAMES).contains(&names);
    if is_stamp && (has_frames || (is_date && cells.len() == 9)) && has_pose(2 + names) {
        found.push(pose(StampColumns::Two(0, 1), 2 + names));
    }
    match cells.len() {
        // The number of a line in front of TUM's columns, or of a node behind them.
        9 => {
            if number(0).is_some_and(is_frame) && is_since_1970(1) && has_pose(2) {
                found.push(pose(one(1), 2));
            }
            if is_since_1970(0) && is_whole(8) && has_pose(1) {
                found.push(pose(one(0), 1));
            }
        }
        // A place alone; with three angles.
        4 if (0..4).all(|at| number(at).is_some()) => {
            let is_stamp = is_since_1970(0) || !is_whole(0);
            let stamp = if is_stamp { one(0) } else { StampColumns::Number(0) };
            found.push(Reading { stamp, place: 1, rotation: Err(NO_ROTATION) });
        }
        7 if is_since_1970(0) && (1..7).all(|at| number(at).is_some()) => {
            let angle = |at: usize| number(at).is_some_and(|angle| angle.abs() <= 360.0);
            let rotation = Err(if (4..7).all(angle) { ANGLES } else { NO_ROTATION });
            found.push(Reading { stamp: one(0), place: 1, rotation });
        }
        _ => {}
    }
    found
}

impl Reading {
    /// Whether every line allows it, and stamps rise.
    fn fits(self, bytes: &[u8], delimiter: Delimiter, columns: usize) -> bool {
        let mut last = f64::NEG_INFINITY;
        bytes.split(|&c| c == b'\n').zip(1..).all(|(line, number)| {
            let Ok(text) = data_of(line, PlaceInFile::Line(number)) else { return false };
            if text.trim().is_empty() {
                return true;
            }
            let cells = delimiter.split(text);
            let cell = |at: usize| cells.get(at).and_then(|cell| cell.parse::<f64>().ok());
            let stamp = match self.stamp {
                StampColumns::One(at, _) | StampColumns::Number(at) => cell(at),
                StampColumns::Two(seconds, ns) => {
                    cell(seconds).zip(cell(ns)).map(|(seconds, ns)| seconds + ns / SECOND_NS)
                }
            };
            let rises = stamp.is_some_and(|stamp| stamp >= std::mem::replace(&mut last, stamp));
            rises && cells.len() == columns && readings(&cells).contains(&self)
        })
    }

    fn header(self, delimiter: Delimiter, columns: usize) -> Header {
        let place = [0, 1, 2].map(|axis| self.place + axis);
        let quaternion = self.rotation.map(|at| [0, 1, 2, 3].map(|axis| at + axis));
        let name = |column: usize| {
            let what = match self.stamp {
                StampColumns::One(at, _) if at == column => "stamp",
                StampColumns::Number(at) if at == column => "number",
                StampColumns::Two(at, _) if at == column => "seconds",
                StampColumns::Two(_, at) if at == column => "nanoseconds",
                _ => {
                    let quaternion = quaternion.as_ref().map_or(&[][..], |columns| columns);
                    let used = place.iter().chain(quaternion).position(|&at| at == column);
                    used.map_or("not used", |k| ["x", "y", "z", "qx", "qy", "qz", "qw"][k])
                }
            };
            format!("{} ({what})", column + 1)
        };
        let names = (0..columns).map(name).collect();
        Header {
            line: 0,
            names,
            delimiter,
            stamp: self.stamp,
            place,
            quaternion: quaternion.map_err(str::to_owned),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(lines: &[&str]) -> Option<(StampColumns, usize, bool)> {
        let header = find(lines.join("\n").as_bytes())?;
        Some((header.stamp, header.place[0], header.quaternion.is_ok()))
    }

    #[test]
    fn tables_without_names_are_read_where_one_reading_is_left() {
        let (one, two) = (|at| StampColumns::One(at, None), StampColumns::Two(0, 1));
        for (lines, reading) in [
            // TIERS, RTAB-Map, `ros2 topic echo --csv` of PoseStamped, of Odometry, with an empty frame, of a simulation.
            (&["17 1700000000.5 1 2 3 0 0 0.6 0.8"][..], Some((one(1), 2, true))),
            (&["1700000000.5 1 2 3 0 0 0.6 0.8 17"], Some((one(0), 1, true))),
            (&["1700000000,500,map,1,2,3,0,0,0.6,0.8"], Some((two, 3, true))),
            (&["1700000000,500,odom,base_link,1,2,3,0,0,0.6,0.8,0.1,0,0"], Some((two, 4, true))),
            (&["1700000000,500,odom,,1,2,3,0,0,0.6,0.8"], Some((two, 4, true))),
            (&["12,500000000,odom,base,1,2,3,0,0,0.6,0.8"], Some((two, 4, true))),
            (&["1700000000,500,1,2,3,0,0,0.6,0.8"], Some((two, 2, true))),
            // Nanoseconds of a simulation, or seconds of the years from 1990 behind a number: later lines say which.
            (&["7,700000000,1,2,3,0,0,0.6,0.8", "8,700000001,1,2,3,0,0,0.6,0.8"], Some((one(1), 2, true))),
            // RTK, check points, NCLT.
            (&["1700000000.5,353000.5,4025000.25,20.5"], Some((one(0), 1, false))),
            (&["17 353000.5 4025000.25 20.5"], Some((StampColumns::Number(0), 1, false))),
            (&["1328456140000000,1.5,2.5,0.1,0.01,-0.02,3.1"], Some((one(0), 1, false))),
            // Two readings, or none.
            (&["1 2 3 4 5"], None),
            (&["17 1700000000.5 1 2 3 9 9 9 9"], None),
            (&["1700000000,500,odom,base,link,1,2,3,0,0,0.6,0.8"], None),
            (&["P1,353000.5,4025000.25,20.5"], None),
        ] {
            assert_eq!(of(lines), reading, "{lines:?}");
        }
    }
}
