//! When the body was at the vertices of a graph: a list of lines, read and written.

use dmp_lengths::thousands;

use super::record::id_of;
use crate::file::columns::numbers;
use crate::file::{found_or, is_header, lines, ns_to_seconds, read_text, to_ns, write_times};
use crate::{LogError, ParseError, PlaceInFile, TimeUnit};
use std::io::{self, Write};
use std::path::Path;

/// Largest list that is read: tens of millions of vertices, more than a graph has.
const MAX_BYTES: u64 = 1 << 30;

/// When the body was at the vertices of a pose graph.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct KeyframeTimes {
    /// The vertices, increasing, where the lines have ids; otherwise the n-th stamp is that of the n-th vertex
    /// in the order of the ids.
    pub ids: Option<Vec<i64>>,
    /// Their stamps in nanoseconds, strictly increasing; at least one.
    pub stamps_ns: Vec<i64>,
    /// What was guessed.
    pub notes: Vec<String>,
}

/// Why times do not belong to a graph.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum KeyframeTimesFault {
    /// Stamps without ids that are not one a vertex.
    #[error("{} stamps without ids for {} vertices", thousands(.stamps), thousands(.vertices))]
    OtherCount {
        /// How many stamps there are.
        stamps: usize,
        /// How many vertices the graph has.
        vertices: usize,
    },
    /// A vertex has no line.
    #[error("no stamp for the vertex {id}")]
    NoStamp {
        /// The vertex.
        id: i64,
    },
}

impl KeyframeTimes {
    /// The stamps of these vertices, nanoseconds, in the order of `ids`, which increase. Stamps of other
    /// vertices are left out.
    ///
    /// # Errors
    /// When a vertex has no stamp, or stamps without ids are more or fewer than the vertices.
    pub fn of_vertices(&self, ids: &[i64]) -> Result<Vec<i64>, KeyframeTimesFault> {
        let Some(known) = &self.ids else {
            let (stamps, vertices) = (self.stamps_ns.len(), ids.len());
            let fault = KeyframeTimesFault::OtherCount { stamps, vertices };
            return if stamps == vertices { Ok(self.stamps_ns.clone()) } else { Err(fault) };
        };
        let stamp = |&id: &i64| {
            let index = known.binary_search(&id).ok();
            let stamp_ns = index.and_then(|index| self.stamps_ns.get(index)).copied();
            stamp_ns.ok_or(KeyframeTimesFault::NoStamp { id })
        };
        ids.iter().map(stamp).collect()
    }
}

/// Columns of lines with an id and a stamp, and of a TUM trajectory; 1 is a stamp alone.
const ID_AND_STAMP: usize = 2;
const TUM: usize = 8;

/// The stamp of a vertex, with the line that has it.
#[derive(Debug, Clone, Copy)]
struct Timed<'a> {
    place: PlaceInFile,
    /// Its number where lines have no ids.
    id: i64,
    /// As it is written.
    stamp: &'a str,
}

/// Parses the times of a pose graph's vertices, to the nanosecond: lines with a stamp each, in the order
/// of the vertices' ids; or with `id stamp`, in any order; or a TUM trajectory, whose poses are not used. All
/// lines are of one kind. The first one may have names of columns instead of numbers. Stamps are in seconds; those that no
/// second of our days has are taken for what they must be, and that is noted.
///
/// # Errors
/// In the first line that is no text, of another kind or no numbers; where a vertex is there twice, or its stamp is
/// not greater than that of the vertex before it; where there is no stamp; and where stamps can be no seconds and do not count
/// from 1970.
pub fn parse_keyframe_times(bytes: &[u8]) -> Result<KeyframeTimes, ParseError> {
    parse_keyframe_times_in(bytes, None)
}

/// As [`parse_keyframe_times`], with stamps in this unit where one is given.
///
/// # Errors
/// As [`parse_keyframe_times`].
pub fn parse_keyframe_times_in(bytes: &[u8], unit: Option<TimeUnit>) -> Result<KeyframeTimes, ParseError> {
    let (mut width, mut times) = (None, Vec::new());
    for (index, line) in lines(bytes).enumerate() {
        let (place, columns) = line?;
        if index == 0 && is_header(&columns) {
            continue;
        }
        let count = columns.len();
        if width.is_none() && !matches!(count, 1 | ID_AND_STAMP | TUM) {
            let problem =
                format!("{count} columns, expected 1 (stamp), 2 (id stamp) or 8 (a TUM trajectory)");
            return Err(ParseError::new(place, problem));
        }
        times.push(timed(place, &columns, *width.get_or_insert(count), times.len())?);
    }
    let has_ids = width == Some(ID_AND_STAMP);
    if has_ids {
        // In a stable order, so that of two lines with one id the later is the wrong one.
        times.sort_by_key(|timed| timed.id);
    }
    let Some(first) = times.first() else {
        return Err(ParseError::new(PlaceInFile::WholeFile, "no stamps: no line of `stamp` or `id stamp`"));
    };
    let mut notes = Vec::new();
    // Keyframes may be far apart; whole numbers that are written with decimals are seconds all the same.
    let has_decimals = times.iter().all(|timed| timed.stamp.contains('.'));
    let otherwise = has_decimals.then_some(TimeUnit::Seconds);
    let unit = unit.map_or_else(|| found_or(otherwise, &numbers_of(&times), first.place, &mut notes), Ok)?;
    let in_ns =
        |timed: &Timed<'_>| to_ns(timed.stamp, unit).map_err(|problem| ParseError::new(timed.place, problem));
    let stamps_ns = times.iter().map(in_ns).collect::<Result<Vec<i64>, ParseError>>()?;
    for (pair, stamps_ns) in times.windows(2).zip(stamps_ns.windows(2)) {
        let ([before, after], [earlier_ns, later_ns]) = (pair, stamps_ns) else { continue };
        check_order((before, *earlier_ns), (after, *later_ns), has_ids)?;
    }
    let ids = has_ids.then(|| times.iter().map(|timed| timed.id).collect());
    Ok(KeyframeTimes { ids, stamps_ns, notes })
}

/// The stamps that are numbers; others are reported where they are parsed.
fn numbers_of(times: &[Timed<'_>]) -> Vec<f64> {
    let numbers = times.iter().filter_map(|timed| timed.stamp.parse::<f64>().ok());
    numbers.filter(|stamp| stamp.is_finite()).collect()
}

/// Reads the times of a pose graph's vertices, as [`parse_keyframe_times`].
///
/// # Errors
/// As [`parse_keyframe_times`], and when the file cannot be read.
pub fn read_keyframe_times(path: &Path) -> Result<KeyframeTimes, LogError> {
    read_keyframe_times_in(path, None)
}

/// As [`read_keyframe_times`], with stamps in this unit where one is given.
///
/// # Errors
/// As [`read_keyframe_times`].
pub fn read_keyframe_times_in(path: &Path, unit: Option<TimeUnit>) -> Result<KeyframeTimes, LogError> {
    let bytes = read_text(path, "list of stamps", MAX_BYTES)?;
    parse_keyframe_times_in(&bytes, unit).map_err(|e| e.in_file(path))
}

/// Writes the times of a pose graph's vertices in seconds: `id stamp` in each line, or the stamp alone without ids;
/// [`parse_keyframe_times`] gives the same back.
///
/// # Errors
/// As `out` does.
pub fn write_keyframe_times(out: &mut impl Write, times: &KeyframeTimes) -> io::Result<()> {
    let Some(ids) = &times.ids else { return write_times(out, &times.stamps_ns) };
    let lines = ids.iter().zip(&times.stamps_ns);
    lines.into_iter().try_for_each(|(id, &ns)| writeln!(out, "{id} {}", ns_to_seconds(ns)))
}

fn timed<'a>(
    place: PlaceInFile,
    columns: &[&'a str],
    width: usize,
    number: usize,
) -> Result<Timed<'a>, ParseError> {
    if columns.len() != width {
        let count = columns.len();
        let problem = format!("{count} columns, the lines before it have {width}: is the line cut?");
        return Err(ParseError::new(place, problem));
    }
    if width == TUM {
        numbers::<8>(place, columns, "stamp tx ty tz qx qy qz qw")?;
    }
    let has_id = width == ID_AND_STAMP;
    let id = if has_id { id_of(place, columns, 0)? } else { number as i64 };
    let stamp = columns.get(usize::from(has_id)).copied().unwrap_or_default();
    Ok(Timed { place, id, stamp })
}

/// Of two vertices one after the other, and their stamps in nanoseconds.
fn check_order(
    (before, before_ns): (&Timed<'_>, i64),
    (after, after_ns): (&Timed<'_>, i64),
    has_ids: bool,
) -> Result<(), ParseError> {
    let (first, here) = (before.place, after.place);
    if has_ids && before.id == after.id {
        return Err(ParseError::new(here, format!("the vertex {} has a stamp in {first} already", after.id)));
    }
    if before_ns < after_ns {
        return Ok(());
    }
    let (earlier, later) = (ns_to_seconds(before_ns), ns_to_seconds(after_ns));
    let problem = if has_ids {
        let (before, after) = (before.id, after.id);
        format!(
            "the vertex {after} has the stamp {later} s, not after that of {before} in {first}, {earlier} s"
        )
    } else {
        format!("the stamp {later} s is not after that in {first}, {earlier} s")
    };
    Err(ParseError::new(here, problem))
}
