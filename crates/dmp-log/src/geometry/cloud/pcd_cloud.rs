//! The points of a PCD file as a cloud: text, rows, or packed field by field, without holding them all.

use super::batches::{Batches, Sink, TextPoints, broken};
use super::format::CloudFormat;
use crate::file::open_sized;
use crate::geometry::pcd::header::{PcdData, PcdField, PcdHeader, packed_sizes};
use crate::geometry::pcd::header_lines::read_header;
use crate::geometry::pcd::lzf::{LzfReader, may_hold};
use crate::points::{Field, NumberType};
use crate::{LogError, PlaceInFile};
use dmp_lengths::thousands;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::Path;

pub(super) fn read<E: From<LogError>>(
    path: &Path,
    scale: [f64; 3],
    sink: &mut Sink<'_, E>,
) -> Result<(CloudFormat, u64), E> {
    let (mut input, length) = open_sized(path)?;
    let header = read_header(&mut input).map_err(|e| e.in_file(path))?;
    let xyz = header.xyz().map_err(|e| e.in_file(path))?;
    header.check_length(length).map_err(|e| e.in_file(path))?;
    let mut batches = Batches::scaled(sink, scale);
    match header.data {
        PcdData::Ascii => {
            let columns = xyz.map(|axis| axis.column);
            let (lines_before, points) = (header.lines, header.points);
            let text = TextPoints { lines_before, skipped: 0, points, columns, name: "points" };
            text.read(path, &mut input, |point| batches.push(point))?;
        }
        PcdData::Binary => read_binary(path, &mut input, &header, xyz, &mut batches)?,
        PcdData::BinaryCompressed => read_compressed(path, &mut input, &header, length, &mut batches)?,
    }
    batches.flush()?;
    Ok((CloudFormat::Pcd, batches.points))
}

fn read_binary<E: From<LogError>>(
    path: &Path,
    input: &mut impl BufRead,
    header: &PcdHeader,
    xyz: [&PcdField; 3],
    batches: &mut Batches<'_, '_, E>,
) -> Result<(), E> {
    // The header limits what a point may have.
    let mut point = vec![0; header.point_bytes];
    for _ in 0..header.points {
        input.read_exact(&mut point).map_err(|e| LogError::io(path, "read", e))?;
        batches.push(xyz.map(|axis| axis.place.coordinate(&point, false)))?;
    }
    Ok(())
}

/// x, y and z lie one after the other, so three decoders walk the file, each with its own window: no more
/// memory for a large cloud than for a small one.
fn read_compressed<E: From<LogError>>(
    path: &Path,
    input: &mut impl BufRead,
    header: &PcdHeader,
    length: u64,
    batches: &mut Batches<'_, '_, E>,
) -> Result<(), E> {
    let mut sizes = [0; 8];
    input.read_exact(&mut sizes).map_err(|e| LogError::io(path, "read", e))?;
    let [compressed, unpacked] = packed_sizes(sizes);
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
        axes.push(Axis::open(path, starts_at, compressed, axis.place.kind, at)?);
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
        Ok(Field { offset: 0, kind: self.kind }.coordinate(bytes, false))
    }
}

fn unpacking<E: From<LogError>>(path: &Path, place: PlaceInFile, error: &io::Error) -> E {
    let problem = match error.kind() {
        io::ErrorKind::UnexpectedEof => "they unpack to fewer bytes than claimed".to_owned(),
        _ => error.to_string(),
    };
    broken(path, place, format!("cannot unpack the points: {problem}"))
}
