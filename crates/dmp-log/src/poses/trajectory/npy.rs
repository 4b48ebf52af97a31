//! Trajectories as arrays of `NumPy`.

use dmp_lengths::thousands;
use dmp_sensor::Trajectory;

use super::error::TrajectoryParseError;
use crate::file::{pose_of_rows, shorten};
use crate::points::{Field, NumberType};
use crate::{ParseError, PlaceInFile};

/// What every such file begins with.
pub(super) const MAGIC: &[u8] = b"\x93NUMPY";

const EXPECTED: &str = "poses are N x 4 x 4 or N x 3 x 4 numbers of type float64 or float32";
/// The last row of a 4 × 4 pose, and how far it may be from that: float32 has seven digits.
const LAST_ROW: [f64; 4] = [0.0, 0.0, 0.0, 1.0];
const LAST_ROW_TOLERANCE: f64 = 1e-6;

/// Parses the array of poses that `numpy.save` writes: N × 4 × 4 or N × 3 × 4, float64 or float32 in either
/// byte order, in C or Fortran order; `world_from_body`, without stamps. Rounded rotations are made exact.
///
/// The format is that of `numpy.lib.format`, versions 1 to 3.
///
/// # Errors
/// When the header is none, when it describes another array, when the file has more or fewer bytes than
/// that array, and in the first pose (by its first byte) that holds something that is no finite number, is
/// no rotation, or lies 10⁸ m away.
pub fn parse_npy(bytes: &[u8]) -> Result<Trajectory, TrajectoryParseError> {
    let mut poses = Vec::new();
    for_each_matrix(bytes, |place, rows| {
        poses.push(pose_of_rows(place, rows)?);
        Ok(())
    })?;
    Ok(Trajectory::unstamped(poses)?)
}

/// Gives `each` the twelve numbers of every pose, row by row, all finite.
pub(super) fn for_each_matrix(
    bytes: &[u8],
    mut each: impl FnMut(PlaceInFile, [f64; 12]) -> Result<(), ParseError>,
) -> Result<(), ParseError> {
    let (header, data_at) = Header::read(bytes)?;
    let data = bytes.get(data_at..).unwrap_or_default();
    let [poses, rows] = [header.poses, header.rows];
    let (kind, big_endian) = header.number;
    let size = kind.bytes() as usize;
    let pose_bytes = rows * 4 * size;
    // Compared before anything is made of it; poses may be any number.
    if poses.checked_mul(pose_bytes) != Some(data.len()) {
        let [bytes, poses] = [data.len(), poses].map(thousands);
        let problem =
            format!("{bytes} bytes of data for {poses} poses of {pose_bytes} bytes: is the file cut?");
        return Err(ParseError::new(PlaceInFile::Byte(data_at as u64), problem));
    }
    for pose in 0..poses {
        // In Fortran order a pose is spread over the file; its first number stands for it.
        let index = |row: usize, column: usize| {
            if header.fortran_order {
                pose + poses * (row + rows * column)
            } else {
                (pose * rows + row) * 4 + column
            }
        };
        let place = PlaceInFile::Byte((data_at + index(0, 0) * size) as u64);
        let number = |row, column| {
            let value = Field { offset: index(row, column) * size, kind }.coordinate(data, big_endian);
            if value.is_finite() {
                return Ok(value);
            }
            Err(ParseError::new(place, format!("pose {pose}: `{value}` is not finite")))
        };
        let mut matrix = [0.0; 12];
        for (k, element) in matrix.iter_mut().enumerate() {
            *element = number(k / 4, k % 4)?;
        }
        if rows == 4 {
            let mut last = [0.0; 4];
            for (column, element) in last.iter_mut().enumerate() {
                *element = number(3, column)?;
            }
            if last.iter().zip(LAST_ROW).any(|(found, is)| (found - is).abs() > LAST_ROW_TOLERANCE) {
                return Err(ParseError::new(
                    place,
                    format!("pose {pose}: its last row is {last:?}, not 0 0 0 1"),
                ));
            }
        }
        each(place, matrix).map_err(|e| ParseError::new(e.place, format!("pose {pose}: {}", e.problem)))?;
    }
    Ok(())
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Header {
    /// Its type, and whether the highest byte comes first.
    number: (NumberType, bool),
    fortran_order: bool,
    poses: usize,
    /// 3 or 4, each of four numbers.
    rows: usize,
}

/// The type that a `descr` names, and whether its highest byte comes first.
fn number_of(descr: &str) -> Option<(NumberType, bool)> {
    let (order, kind) = descr.split_at_checked(1)?;
    let big_endian = match order {
        "<" => false,
        ">" => true,
        "=" => cfg!(target_endian = "big"),
        _ => return None,
    };
    match kind {
        "f8" => Some((NumberType::F64, big_endian)),
        "f4" => Some((NumberType::F32, big_endian)),
        _ => None,
    }
}

impl Header {
    /// The header and where the data begin.
    fn read(bytes: &[u8]) -> Result<(Self, usize), ParseError> {
        let error = |at: usize, problem: String| ParseError::new(PlaceInFile::Byte(at as u64), problem);
        let after = bytes.strip_prefix(MAGIC).ok_or_else(|| {
            let start = bytes.get(..MAGIC.len()).unwrap_or(bytes);
            error(0, format!("no .npy file: it starts with {start:02x?}"))
        })?;
        // The text ends at the byte `end`; its length has two bytes in version 1, four in later ones.
        let (start, length) = match *after {
            [1, 0, a, b, ..] => (10, usize::from(u16::from_le_bytes([a, b]))),
            [2 | 3, 0, a, b, c, d, ..] => (12, u32::from_le_bytes([a, b, c, d]) as usize),
            [major, minor, ..] if !(1..=3).contains(&major) || minor != 0 => {
                return Err(error(6, format!("version {major}.{minor} of .npy files is not known here")));
            }
            _ => return Err(error(bytes.len(), "the file ends within its header".into())),
        };
        let end = start + length;
        let Some(text) = bytes.get(start..end) else {
            return Err(error(
                start,
                format!("a header of {} bytes in a file of {}", thousands(length), thousands(bytes.len())),
            ));
        };
        let text = std::str::from_utf8(text).map_err(|_| error(start, "the header is not text".into()))?;
        let bad =
            |problem: String| error(start, format!("{problem} in the header `{}`", shorten(text.trim())));
        let (mut descr, mut fortran_order, mut shape) = (None, None, None);
        for (key, value) in dictionary(text).map_err(bad)? {
            let place = match key {
                "descr" => &mut descr,
                "fortran_order" => &mut fortran_order,
                "shape" => &mut shape,
                _ => return Err(bad(format!("an unknown key `{key}`"))),
            };
            if place.replace(value).is_some() {
                return Err(bad(format!("`{key}` twice")));
            }
        }
        let (Some(descr), Some(fortran_order), Some(shape)) = (descr, fortran_order, shape) else {
            return Err(bad("not all of descr, fortran_order and shape".into()));
        };
        let number =
            string(descr).and_then(number_of).ok_or_else(|| bad(format!("the type {descr}; {EXPECTED};")))?;
        let fortran_order = match fortran_order {
            "True" => true,
            "False" => false,
            other => return Err(bad(format!("the fortran_order {other}"))),
        };
        match numbers_of(shape).as_deref() {
            Some(&[poses, rows @ (3 | 4), 4]) => Ok((Self { number, fortran_order, poses, rows }, end)),
            _ => Err(bad(format!("the shape {shape}; {EXPECTED};"))),
        }
    }
}

/// The keys and values of the text of a Python dictionary whose keys are strings and whose values are
/// strings, words or tuples of words.
fn dictionary(text: &str) -> Result<Vec<(&str, &str)>, String> {
    let open = text.trim().strip_prefix('{').and_then(|text| text.strip_suffix('}'));
    let mut rest = open.ok_or("no dictionary")?.trim();
    let mut entries = Vec::new();
    while !rest.is_empty() {
        let (key, value) = rest.split_once(':').ok_or("a key without a value")?;
        let key = string(key.trim()).ok_or("a key that is no string")?;
        let value = value.trim_start();
        let length = match value.as_bytes().first() {
            Some(b'(') => value.find(')').map(|at| at + 1),
            Some(quote @ (b'\'' | b'"')) => {
                value.get(1..).and_then(|v| v.find(char::from(*quote))).map(|at| at + 2)
            }
            _ => Some(value.find(',').unwrap_or(value.len())),
        };
        let (value, after) = length
            .and_then(|length| value.split_at_checked(length))
            .ok_or_else(|| format!("a value of `{key}` without an end"))?;
        entries.push((key, value.trim()));
        let after = after.trim_start();
        rest = match after.strip_prefix(',') {
            Some(after) => after.trim_start(),
            None if after.is_empty() => after,
            None => return Err(format!("no comma after `{key}`")),
        };
    }
    Ok(entries)
}

fn string(text: &str) -> Option<&str> {
    ['\'', '"'].into_iter().find_map(|quote| text.strip_prefix(quote)?.strip_suffix(quote))
}

/// The whole numbers of a tuple; Python 2 put an `L` behind large ones.
fn numbers_of(tuple: &str) -> Option<Vec<usize>> {
    let inner = tuple.strip_prefix('(')?.strip_suffix(')')?.trim();
    let inner = inner.strip_suffix(',').unwrap_or(inner);
    inner.split(',').map(|number| number.trim().trim_end_matches('L').parse().ok()).collect()
}
