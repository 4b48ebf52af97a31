//! The head of a PLY file with one scan.

use crate::geometry::cloud::ply_header::{Encoding, PlyHeader, read_header};
use crate::logs::scan_folder::scan_file::head::{Body, Head};
use crate::logs::scan_folder::scan_file::text::TextRows;
use crate::points::Layout;
use crate::{ParseError, PlaceInFile};
use std::io::BufRead;

/// Reads and checks a head. Elements in front of the vertices are passed over.
pub(crate) fn head(input: &mut impl BufRead) -> Result<Head, ParseError> {
    let header = read_header(input)?;
    let PlyHeader { encoding, lines, bytes, before, vertices: points, vertex_bytes, named, .. } = header;
    let wrong = |problem: String| ParseError::new(PlaceInFile::Line(lines), problem);
    if encoding == Encoding::Ascii {
        let columns = named.into_iter().enumerate();
        let columns: Vec<_> = columns.map(|(column, (name, field))| (name, column, field.kind)).collect();
        let (rows, named) = TextRows::new(&columns);
        let layout = Layout::new(named, false, rows.row_bytes()).map_err(wrong)?;
        let skipped = before.iter().fold(0_u64, |sum, &(rows, _)| sum.saturating_add(rows));
        let body = Body::Text { data_at: bytes, lines_before: lines, skipped, rows };
        return Ok(Head { layout, points, body });
    }
    let data_at = before
        .iter()
        .try_fold(bytes, |at, &(rows, row_bytes)| at.checked_add(rows.checked_mul(row_bytes)?))
        .ok_or_else(|| wrong("the elements before the vertices are larger than any file".into()))?;
    let big_endian = encoding == Encoding::BigEndian;
    let layout = Layout::new(named, big_endian, vertex_bytes as u32).map_err(wrong)?;
    Ok(Head { layout, points, body: Body::Rows { data_at } })
}
