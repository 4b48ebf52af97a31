//! The vertices of a PLY file as a cloud, and for meshes.

use super::batches::{Batches, broken};
use super::format::CloudFormat;
use super::ply_header::{Coordinate, Encoding, PlyHeader, read_header};
use crate::decimal::shorten;
use crate::reads::open_sized;
use crate::text::read_line;
use crate::{LogError, PlaceInFile};
use dmp_lengths::thousands;
use std::io::{BufRead, Read};
use std::path::Path;

/// Reads the vertices of a PLY file row by row; other elements are passed over or never reached.
pub(super) fn read<E, F>(path: &Path, scale: [f64; 3], sink: &mut F) -> Result<(CloudFormat, u64), E>
where
    E: From<LogError>,
    F: FnMut(&[[f64; 3]]) -> Result<(), E>,
{
    let (mut input, length) = open_sized(path)?;
    let header = read_header(&mut input).map_err(|e| e.in_file(path))?;
    let mut batches = Batches::scaled(sink, scale);
    read_vertices(path, &mut input, &header, length, |point| batches.push(point))?;
    batches.flush()?;
    Ok((CloudFormat::Ply, batches.points))
}

/// Reads the vertices behind the header of a file of `length` bytes. Answers the number of the last line
/// read, in text.
pub(crate) fn read_vertices<E: From<LogError>>(
    path: &Path,
    input: &mut impl BufRead,
    header: &PlyHeader,
    length: u64,
    each: impl FnMut([f64; 3]) -> Result<(), E>,
) -> Result<u64, E> {
    match header.encoding {
        Encoding::Ascii => read_text(path, input, header, each),
        _ => read_binary(path, input, header, length, each).map(|()| header.lines),
    }
}

fn read_text<E: From<LogError>>(
    path: &Path,
    input: &mut impl BufRead,
    header: &PlyHeader,
    mut each: impl FnMut([f64; 3]) -> Result<(), E>,
) -> Result<u64, E> {
    let skipped = header.before.iter().fold(0_u64, |sum, &(rows, _)| sum.saturating_add(rows));
    let (mut number, mut row, mut line) = (header.lines, 0, Vec::new());
    while row < header.vertices.saturating_add(skipped) {
        number += 1;
        let place = PlaceInFile::Line(number);
        let read = read_line(input, &mut line);
        if read.map_err(|e| LogError::malformed(path, place, e.to_string()))?.is_none() {
            let (got, claimed) = (row.saturating_sub(skipped), header.vertices);
            return Err(broken(
                path,
                place,
                format!("the file ends after {} of {} vertices", thousands(got), thousands(claimed)),
            ));
        }
        if line.is_empty() {
            continue;
        }
        row += 1;
        if row > skipped {
            let text = String::from_utf8_lossy(&line);
            let columns: Vec<&str> = text.split_ascii_whitespace().collect();
            let coordinate = |axis: Coordinate| {
                let column = columns.get(axis.column).copied().unwrap_or_default();
                column.parse::<f64>().map_err(|_| {
                    let what = format!("`{}` in column {} is not a number", shorten(column), axis.column + 1);
                    broken(path, place, what)
                })
            };
            let [x, y, z] = header.xyz;
            each([coordinate(x)?, coordinate(y)?, coordinate(z)?])?;
        }
    }
    Ok(number)
}

fn read_binary<E: From<LogError>>(
    path: &Path,
    input: &mut impl BufRead,
    header: &PlyHeader,
    length: u64,
    mut each: impl FnMut([f64; 3]) -> Result<(), E>,
) -> Result<(), E> {
    let left = length.saturating_sub(header.bytes);
    let of = |rows: u64, bytes: u64| rows.checked_mul(bytes);
    let skipped =
        header.before.iter().try_fold(0_u64, |sum, &(rows, bytes)| sum.checked_add(of(rows, bytes)?));
    let needed =
        of(header.vertices, header.vertex_bytes as u64).and_then(|bytes| bytes.checked_add(skipped?));
    let (Some(skipped), Some(_)) = (skipped, needed.filter(|&needed| needed <= left)) else {
        let problem = format!(
            "{} vertices of {} bytes do not fit in the {} bytes behind the header",
            thousands(header.vertices),
            header.vertex_bytes,
            thousands(left)
        );
        return Err(broken(path, PlaceInFile::Byte(header.bytes), problem));
    };
    let io = |e| LogError::io(path, "read", e);
    std::io::copy(&mut input.by_ref().take(skipped), &mut std::io::sink()).map_err(io)?;
    // The header is limited in its lines, so a vertex is in its bytes.
    let mut vertex = vec![0; header.vertex_bytes];
    for _ in 0..header.vertices {
        input.read_exact(&mut vertex).map_err(io)?;
        let big_endian = header.encoding == Encoding::BigEndian;
        each(header.xyz.map(|axis| coordinate(&vertex, axis, big_endian)))?;
    }
    Ok(())
}

fn coordinate(vertex: &[u8], axis: Coordinate, big_endian: bool) -> f64 {
    let bytes = vertex.get(axis.offset..).unwrap_or_default();
    let value = match (axis.double, big_endian) {
        (false, false) => bytes.first_chunk().map(|b| f32::from_le_bytes(*b).into()),
        (false, true) => bytes.first_chunk().map(|b| f32::from_be_bytes(*b).into()),
        (true, false) => bytes.first_chunk().map(|b| f64::from_le_bytes(*b)),
        (true, true) => bytes.first_chunk().map(|b| f64::from_be_bytes(*b)),
    };
    value.unwrap_or(f64::NAN)
}
