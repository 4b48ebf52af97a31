//! The points of a PCD file with `DATA binary_compressed`: field by field, packed as a whole.

use crate::file::fill;
use crate::geometry::pcd::header::{PcdField, PcdHeader, packed_sizes};
use crate::geometry::pcd::lzf;
use crate::points::Field;
use crate::{LogError, ParseError, PlaceInFile};
use dmp_lengths::thousands;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

/// The body of a file with `DATA binary_compressed`.
#[derive(Debug)]
pub(crate) struct Packed {
    data_at: u64,
    compressed_bytes: u64,
    uncompressed_bytes: u64,
    points: u64,
    /// Where each field's numbers begin in the unpacked bytes, and where they go in a row.
    columns: Vec<(u64, Field)>,
    pub(crate) row_bytes: u32,
}

pub(crate) fn packed(
    header: &PcdHeader,
    input: &mut (impl Read + Seek),
    length: u64,
) -> Result<(Packed, Named), ParseError> {
    let PcdHeader { points, bytes: data_at, .. } = *header;
    let wrong = |problem: String| ParseError::new(PlaceInFile::Byte(data_at), problem);
    let mut sizes = [0; 8];
    let read = input.seek(SeekFrom::Start(data_at)).and_then(|_| input.read_exact(&mut sizes));
    read.map_err(|_| wrong("the file ends before the sizes of the compressed points".into()))?;
    let [compressed_bytes, uncompressed_bytes] = packed_sizes(sizes);
    let left = length.saturating_sub(data_at + 8);
    if compressed_bytes > left {
        return Err(wrong(format!(
            "{} compressed bytes are claimed, {} are left: is it cut?",
            thousands(compressed_bytes),
            thousands(left)
        )));
    }
    if !lzf::may_hold(compressed_bytes, uncompressed_bytes) {
        let [packed, unpacked] = [compressed_bytes, uncompressed_bytes].map(thousands);
        return Err(wrong(format!("{packed} compressed bytes cannot hold {unpacked}")));
    }
    let (mut columns, mut named, mut row_bytes) = (Vec::new(), Named::new(), 0);
    for (field, at) in header.columns(uncompressed_bytes)? {
        if is_single(field) {
            let place = Field { offset: row_bytes as usize, kind: field.place.kind };
            columns.push((at, place));
            named.push((field.name.clone(), place));
            row_bytes += place.kind.bytes();
        }
    }
    Ok((Packed { data_at, compressed_bytes, uncompressed_bytes, points, columns, row_bytes }, named))
}

impl Packed {
    /// Unpacks the points and puts the numbers of each beside each other.
    pub(crate) fn read_rows(
        &self,
        path: &Path,
        input: &mut (impl Read + Seek),
        rows: &mut Vec<u8>,
    ) -> Result<(), LogError> {
        let data_at = self.data_at + 8;
        fill(path, input, data_at, self.compressed_bytes, rows)?;
        let unpacked = lzf::decompress(rows, self.uncompressed_bytes).map_err(|problem| {
            let problem = format!("the compressed points from here cannot be unpacked: {problem}");
            LogError::malformed(path, PlaceInFile::Byte(data_at), problem)
        })?;
        rows.clear();
        // No more than were unpacked: `columns` of the header says so.
        rows.resize(self.points as usize * self.row_bytes as usize, 0);
        for &(at, field) in &self.columns {
            let size = field.kind.bytes() as usize;
            let numbers = unpacked.get(at as usize..).unwrap_or_default().chunks_exact(size);
            for (row, number) in rows.chunks_exact_mut(self.row_bytes as usize).zip(numbers) {
                if let Some(place) = row.get_mut(field.offset..field.offset + size) {
                    place.copy_from_slice(number);
                }
            }
        }
        Ok(())
    }
}

pub(crate) type Named = Vec<(String, Field)>;

/// Fields of several numbers are histograms and padding.
pub(crate) fn is_single(field: &PcdField) -> bool {
    field.count == 1 && field.name != "_"
}
