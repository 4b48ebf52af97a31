//! The points of a PCD file as a cloud: text, rows, or packed field by field, without holding them all.

use super::batches::{Batches, broken};
use super::format::CloudFormat;
use crate::decimal::shorten;
use crate::pcd::header::{PcdData, PcdField, PcdHeader};
use crate::pcd::header_lines::read_header;
use crate::pcd::lzf::{LzfReader, may_hold};
use crate::points::NumberType;
use crate::reads::open_sized;
use crate::text::read_line;
use crate::{LogError, PlaceInFile};
use dmp_lengths::thousands;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::Path;

/// Reads the points of a PCD file.
pub(super) fn read<E, F>(path: &Path, scale: [f64; 3], sink: &mut F) -> Result<(CloudFormat, u64), E>
where
    E: From<LogError>,
    F: FnMut(&[[f64; 3]]) -> Result<(), E>,
{
    let (mut input, length) = open_sized(path)?;
    let header = read_header(&mut input).map_err(|e| e.in_file(path))?;
    let xyz = header.xyz().map_err(|e| e.in_file(path))?;
    header.check_length(length).map_err(|e| e.in_file(path))?;
    let mut batches = Batches::scaled(sink, scale);
    match header.data {
        PcdData::Ascii => read_text(path, &mut input, &header, xyz, &mut batches)?,
        PcdData::Binary => read_binary(path, &mut input, &header, xyz, &mut batches)?,
        PcdData::BinaryCompressed => read_compressed(path, &mut input, &header, length, &mut batches)?,
    }
    batches.flush()?;
    Ok((CloudFormat::Pcd, batches.points))
}

fn read_text<E: From<LogError>, F: FnMut(&[[f64; 3]]) -> Result<(), E>>(
    path: &Path,
    input: &mut impl BufRead,
    header: &PcdHeader,
    xyz: [&PcdField; 3],
    batches: &mut Batches<'_, F>,
) -> Result<(), E> {
    let (mut number, mut line) = (header.lines, Vec::new());
    while batches.points < header.points {
        number += 1;
        let place = PlaceInFile::Line(number);
        let read = read_line(input, &mut line);
        if read.map_err(|e| LogError::malformed(path, place, e.to_string()))?.is_none() {
            let problem = format!(
                "the file ends after {} of {} points",
                thousands(batches.points),
                thousands(header.points)
            );
            return Err(broken(path, place, problem));
        }
        if line.is_empty() {
            continue;
        }
        let text = String::from_utf8_lossy(&line);
        let columns: Vec<&str> = text.split_ascii_whitespace().collect();
        let coordinate = |axis: &PcdField| {
            let column = columns.get(axis.column).copied().unwrap_or_default();
            column.parse::<f64>().map_err(|_| {
                let what = format!("`{}` in column {} is not a number", shorten(column), axis.column + 1);
                broken(path, place, what)
            })
        };
        let [x, y, z] = xyz;
        batches.push([coordinate(x)?, coordinate(y)?, coordinate(z)?])?;
    }
    Ok(())
}

fn read_binary<E: From<LogError>, F: FnMut(&[[f64; 3]]) -> Result<(), E>>(
    path: &Path,
    input: &mut impl BufRead,
    header: &PcdHeader,
    xyz: [&PcdField; 3],
    batches: &mut Batches<'_, F>,
) -> Result<(), E> {
    // The header limits what a point may have.
    let mut point = vec![0; header.point_bytes];
    for _ in 0..header.points {
        input.read_exact(&mut point).map_err(|e| LogError::io(path, "read", e))?;
        let number = |axis: &PcdField| number(axis.kind, point.get(axis.offset_bytes..).unwrap_or_default());
        batches.push(xyz.map(number))?;
    }
    Ok(())
}

/// x, y and z lie one after the other, so three decoders walk the file, each with its own window: no more
/// memory for a large cloud than for a small one.
fn read_compressed<E: From<LogError>, F: FnMut(&[[f64; 3]]) -> Result<(), E>>(
    path: &Path,
    input: &mut impl BufRead,
    header: &PcdHeader,
    length: u64,
    batches: &mut Batches<'_, F>,
) -> Result<(), E> {
    let mut sizes = [0; 8];
    input.read_exact(&mut sizes).map_err(|e| LogError::io(path, "read", e))?;
    let [compressed, unpacked] = [0, 4].map(|at| {
        u64::from(sizes.get(at..).and_then(<[u8]>::first_chunk).map_or(0, |b| u32::from_le_bytes(*b)))
    });
    let starts_at = header.bytes + 8;
    if compressed > length.saturating_sub(starts_at) || !may_hold(compressed, unpacked) {
        let problem = format!(
            "{} compressed bytes that unpack to {}, in the {} bytes behind the header",
            thousands(compressed),
            thousands(unpacked),
            thousands(length.saturating_sub(starts_at))
        );
        return Err(broken(path, PlaceInFile::Byte(header.bytes), problem));
    }
    let columns = header.columns(unpacked).map_err(|e| e.in_file(path))?;
    let mut axes = Vec::new();
    for axis in header.xyz().map_err(|e| e.in_file(path))? {
        let column = columns.iter().find(|(field, _)| *field == axis);
        let at = column.map_or(0, |&(_, at)| at);
        axes.push(Axis::open(path, starts_at, compressed, axis.kind, at)?);
    }
    for point in 0..header.points {
        let mut place = [0.0; 3];
        for (coordinate, axis) in place.iter_mut().zip(&mut axes) {
            *coordinate = axis.next().map_err(|e| unpacking::<E>(path, PlaceInFile::Point(point), &e))?;
        }
        batches.push(place)?;
    }
    Ok(())
}

/// The numbers of one axis, unpacked one by one.
struct Axis {
    kind: NumberType,
    input: BufReader<LzfReader<io::Take<BufReader<File>>>>,
}

impl Axis {
    fn open<E: From<LogError>>(
        path: &Path,
        starts_at: u64,
        compressed: u64,
        kind: NumberType,
        column_at: u64,
    ) -> Result<Self, E> {
        let mut file = File::open(path).map_err(|e| LogError::io(path, "open", e))?;
        file.seek(SeekFrom::Start(starts_at)).map_err(|e| LogError::io(path, "read", e))?;
        let input = LzfReader::new(BufReader::with_capacity(1 << 16, file).take(compressed));
        let mut input = BufReader::with_capacity(1 << 16, input);
        let skip = io::copy(&mut input.by_ref().take(column_at), &mut io::sink());
        skip.map_err(|e| unpacking::<E>(path, PlaceInFile::Byte(starts_at), &e))?;
        Ok(Self { kind, input })
    }

    fn next(&mut self) -> io::Result<f64> {
        let mut bytes = [0; 8];
        let bytes = bytes.get_mut(..self.kind.bytes() as usize).unwrap_or_default();
        self.input.read_exact(bytes)?;
        Ok(number(self.kind, bytes))
    }
}

fn unpacking<E: From<LogError>>(path: &Path, place: PlaceInFile, error: &io::Error) -> E {
    let problem = match error.kind() {
        io::ErrorKind::UnexpectedEof => "they unpack to fewer bytes than claimed".to_owned(),
        _ => error.to_string(),
    };
    broken(path, place, format!("cannot unpack the points: {problem}"))
}

fn number(kind: NumberType, bytes: &[u8]) -> f64 {
    let value = match kind {
        NumberType::F32 => bytes.first_chunk().map(|b| f32::from_le_bytes(*b).into()),
        NumberType::F64 => bytes.first_chunk().map(|b| f64::from_le_bytes(*b)),
        // No header with coordinates of another kind comes this far.
        _ => None,
    };
    value.unwrap_or(f64::NAN)
}
