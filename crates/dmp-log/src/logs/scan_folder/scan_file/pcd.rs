//! The head of a PCD file with one scan.

use crate::geometry::pcd::header::{PcdData, PcdField, PcdHeader};
use crate::geometry::pcd::header_lines::read_header;
use crate::logs::scan_folder::scan_file::head::{Body, Head};
use crate::logs::scan_folder::scan_file::packed::{is_single, packed};
use crate::logs::scan_folder::scan_file::text::TextRows;
use crate::points::{Field, Layout};
use crate::{ParseError, PlaceInFile};
use std::io::{BufRead, Seek};

/// Reads and checks a head.
pub(crate) fn head(input: &mut (impl BufRead + Seek), length: u64) -> Result<Head, ParseError> {
    let header = read_header(input)?;
    let PcdHeader { points, bytes: data_at, lines, .. } = header;
    let wrong = |problem: String| ParseError::new(PlaceInFile::Line(lines), problem);
    let layout = |named: Vec<(String, Field)>, row_bytes: u32| {
        if points == 0 {
            return Ok(Layout::of_nothing(named, false, row_bytes));
        }
        Layout::new(named, false, row_bytes).map_err(wrong)
    };
    let singles = || header.fields.iter().filter(|field| is_single(field));
    match header.data {
        PcdData::Binary => {
            let place = |field: &PcdField| (field.name.clone(), field.place);
            let layout = layout(singles().map(place).collect(), header.point_bytes as u32)?;
            Ok(Head { layout, points, body: Body::Rows { data_at } })
        }
        PcdData::Ascii => {
            let column = |field: &PcdField| (field.name.clone(), field.column, field.place.kind);
            let (rows, named) = TextRows::new(&singles().map(column).collect::<Vec<_>>());
            let layout = layout(named, rows.row_bytes())?;
            Ok(Head { layout, points, body: Body::Text { data_at, lines_before: lines, skipped: 0, rows } })
        }
        PcdData::BinaryCompressed => {
            let (packed, named) = packed(&header, input, length)?;
            let layout = layout(named, packed.row_bytes)?;
            Ok(Head { layout, points, body: Body::Packed(packed) })
        }
    }
}
