//! The lines of a PCD header, parsed and checked.

use super::header::{PcdData, PcdField, PcdHeader};
use crate::file::{read_line, shorten};
use crate::points::{Field, NumberType};
use crate::{ParseError, PlaceInFile};
use std::io::BufRead;

const MAX_HEADER_LINES: u64 = 1000;
/// Most bytes of a point: above this a header is believed to be damaged.
const MAX_POINT_BYTES: u64 = 1 << 20;

/// A kind of number by its letter and its bytes.
fn kind_of(letter: &str, size: &str) -> Option<NumberType> {
    Some(match (letter, size) {
        ("I", "1") => NumberType::I8,
        ("I", "2") => NumberType::I16,
        ("I", "4") => NumberType::I32,
        ("I", "8") => NumberType::I64,
        ("U", "1") => NumberType::U8,
        ("U", "2") => NumberType::U16,
        ("U", "4") => NumberType::U32,
        ("U", "8") => NumberType::U64,
        ("F", "4") => NumberType::F32,
        ("F", "8") => NumberType::F64,
        _ => return None,
    })
}

/// The lines of a header, as found.
#[derive(Default)]
struct Lines {
    fields: Vec<String>,
    sizes: Vec<String>,
    types: Vec<String>,
    counts: Vec<String>,
    width: Option<u64>,
    height: Option<u64>,
    points: Option<u64>,
}

/// Reads a header up to and including its `DATA` line.
pub(crate) fn read_header(input: &mut impl BufRead) -> Result<PcdHeader, ParseError> {
    let (mut number, mut bytes, mut line, mut found) = (0, 0, Vec::new(), Lines::default());
    let data = loop {
        number += 1;
        let wrong = |problem: String| ParseError::new(PlaceInFile::Line(number), problem);
        match read_line(input, &mut line).map_err(|e| wrong(e.to_string()))? {
            None => return Err(wrong("the file ends in the header".into())),
            Some(_) if number > MAX_HEADER_LINES => return Err(wrong("the header does not end".into())),
            Some(count) => bytes += count,
        }
        let text = std::str::from_utf8(&line).map_err(|_| wrong("not text in the header".into()))?;
        let text = text.split('#').next().unwrap_or_default();
        let mut words = text.split_ascii_whitespace();
        let Some(key) = words.next() else { continue };
        let list = || text.split_ascii_whitespace().skip(1).map(str::to_owned).collect();
        let count = || {
            let value = text.split_ascii_whitespace().nth(1).unwrap_or_default();
            let count = value.parse::<u64>();
            count.map(Some).map_err(|_| wrong(format!("{key} of `{}` is no count", shorten(value))))
        };
        match key {
            "VERSION" | "VIEWPOINT" => {}
            "FIELDS" | "COLUMNS" => found.fields = list(),
            "SIZE" => found.sizes = list(),
            "TYPE" => found.types = list(),
            "COUNT" => found.counts = list(),
            "WIDTH" => found.width = count()?,
            "HEIGHT" => found.height = count()?,
            "POINTS" => found.points = count()?,
            "DATA" => match words.next().unwrap_or_default() {
                "ascii" => break PcdData::Ascii,
                "binary" => break PcdData::Binary,
                "binary_compressed" => break PcdData::BinaryCompressed,
                other => return Err(wrong(format!("data kept as `{}` is not read", shorten(other)))),
            },
            _ => return Err(wrong(format!("not a line of a PCD header: `{}`", shorten(text)))),
        }
    };
    let wrong = |problem: String| ParseError::new(PlaceInFile::Line(number), problem);
    let points = points_of(&found).map_err(wrong)?;
    let (fields, point_bytes) = fields_of(&found).map_err(wrong)?;
    Ok(PcdHeader { fields, point_bytes, points, data, lines: number, bytes })
}

fn points_of(found: &Lines) -> Result<u64, String> {
    let grid = match (found.width, found.height) {
        (Some(width), Some(height)) => {
            let product = width.checked_mul(height);
            Some(product.ok_or_else(|| format!("WIDTH {width} times HEIGHT {height} is too large"))?)
        }
        (Some(width), None) => Some(width),
        (None, Some(height)) => return Err(format!("HEIGHT {height} without WIDTH")),
        (None, None) => None,
    };
    match (grid, found.points) {
        (Some(grid), Some(points)) if grid != points => {
            Err(format!("{points} POINTS, but WIDTH times HEIGHT is {grid}"))
        }
        (Some(points), _) | (None, Some(points)) => Ok(points),
        (None, None) => Err("neither POINTS nor WIDTH in the header".into()),
    }
}

fn fields_of(found: &Lines) -> Result<(Vec<PcdField>, usize), String> {
    let names = found.fields.len();
    let lists = [("SIZE", &found.sizes), ("TYPE", &found.types), ("COUNT", &found.counts)];
    for (key, list) in lists {
        let may_lack = key == "COUNT" && list.is_empty();
        if list.len() != names && !may_lack {
            return Err(format!("{names} FIELDS, but {} entries in {key}", list.len()));
        }
    }
    let (mut fields, mut offset, mut column) = (Vec::new(), 0_u64, 0);
    for (k, ((name, size), letter)) in found.fields.iter().zip(&found.sizes).zip(&found.types).enumerate() {
        let short = shorten(name);
        let kind = kind_of(letter, size).ok_or_else(|| {
            format!("field `{short}` has the unknown type {} of {} bytes", shorten(letter), shorten(size))
        })?;
        let count = found.counts.get(k).map_or("1", String::as_str);
        let count = count.parse::<u64>().ok().filter(|&count| count <= MAX_POINT_BYTES);
        let count = count.ok_or_else(|| {
            let value = found.counts.get(k).map_or("", String::as_str);
            format!("field `{short}` has a COUNT of `{}`", shorten(value))
        })?;
        let place = Field { offset: offset as usize, kind };
        let field = PcdField { name: name.clone(), place, column, count: count as usize };
        column += field.count;
        offset += field.bytes() as u64;
        if offset > MAX_POINT_BYTES {
            return Err(format!("a point of {offset} bytes and more; at most {MAX_POINT_BYTES} are read"));
        }
        fields.push(field);
    }
    Ok((fields, offset as usize))
}
