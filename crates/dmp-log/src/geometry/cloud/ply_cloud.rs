//! The vertices of a PLY file as a cloud, and for meshes.

use super::batches::{Batches, Sink, TextPoints, broken};
use super::format::CloudFormat;
use super::ply_header::{Encoding, PlyHeader, read_header};
use crate::file::open_sized;
use crate::{LogError, PlaceInFile};
use dmp_lengths::thousands;
use std::io::{BufRead, Read};
use std::path::Path;

/// Reads the vertices of a PLY file row by row; other elements are passed over or never reached.
pub(super) fn read<E: From<LogError>>(
    path: &Path,
    scale: [f64; 3],
    sink: &mut Sink<'_, E>,
) -> Result<(CloudFormat, u64), E> {
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
    if header.encoding != Encoding::Ascii {
        return read_binary(path, input, header, length, each).map(|()| header.lines);
    }
    let text = TextPoints {
        lines_before: header.lines,
        skipped: header.before.iter().fold(0_u64, |sum, &(rows, _)| sum.saturating_add(rows)),
        points: header.vertices,
        columns: header.xyz.map(|(column, _)| column),
        name: "vertices",
    };
    text.read(path, input, each)
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
    let big_endian = header.encoding == Encoding::BigEndian;
    for _ in 0..header.vertices {
        input.read_exact(&mut vertex).map_err(io)?;
        each(header.xyz.map(|(_, axis)| axis.coordinate(&vertex, big_endian)))?;
    }
    Ok(())
}
