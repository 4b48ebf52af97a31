//! A file with one scan: its head, compared with its length, and the rows of points behind it.

use crate::file::{CountedFile, KnownFile, ReadCount, fill};
use crate::logs::scan_folder::scan_file::format::ScanFormat;
use crate::logs::scan_folder::scan_file::head::{Body, Head};
use crate::logs::scan_folder::scan_file::{las, pcd, ply};
use crate::points::Layout;
use crate::{LogError, ParseError, PlaceInFile};
use dmp_lengths::thousands;
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::Path;

/// Bytes read at once: heads are short, and there are many files.
const BUFFER_BYTES: usize = 1 << 13;

/// A file with a scan, open, its head read and compared with its length.
#[derive(Debug)]
pub(crate) struct ScanFile {
    pub(crate) known: KnownFile,
    input: BufReader<CountedFile>,
    count: ReadCount,
    pub(crate) head: Head,
}

/// What is missing at the end of a file that is cut short.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Cut {
    pub(crate) place: PlaceInFile,
    pub(crate) what: String,
}

impl ScanFile {
    /// Opens a file and reads its head; `bin` is the layout of files without one.
    pub(crate) fn open(
        path: &Path,
        (format, bin): (ScanFormat, Option<&Layout>),
        count: &ReadCount,
    ) -> Result<Self, LogError> {
        let file = count.open(path).map_err(|e| LogError::io(path, "open", e))?;
        let metadata = file.metadata().map_err(|e| LogError::io(path, "read", e))?;
        let known = KnownFile::new(path, &metadata);
        let length = known.length;
        let mut input = BufReader::with_capacity(BUFFER_BYTES, file);
        let in_file = |e: ParseError| e.in_file(path);
        let head = match format {
            ScanFormat::Bin => Ok(bin_head(length, bin)),
            ScanFormat::Pcd => pcd::head(&mut input, length).map_err(in_file),
            ScanFormat::Ply => ply::head(&mut input).map_err(in_file),
            ScanFormat::Las => las::head(path, &mut input, length),
        }?;
        Ok(Self { known, input, count: count.clone(), head })
    }

    /// How many of the points claimed are there, and what is missing. A text has to be read for it; what is compressed is
    /// unpacked where that is wanted, as nothing else shows whether it can be.
    pub(crate) fn whole_points(&mut self, unpack: bool) -> Result<(u64, Option<Cut>), LogError> {
        let Head { layout, points, body } = &self.head;
        match body {
            Body::Las { compressed: true } if unpack => {
                las::decode(&self.known.path, &self.count, *points)?;
                Ok((*points, None))
            }
            Body::Packed(_) if unpack => {
                let points = *points;
                self.read_rows(points, &mut Vec::new())?;
                Ok((points, None))
            }
            Body::Rows { data_at } => Ok(whole_rows(*data_at, layout, *points, self.known.length)),
            Body::Text { .. } => self.read_text(*points, &mut Vec::new(), true),
            Body::Packed(_) | Body::Las { .. } => Ok((*points, None)),
        }
    }

    /// Puts the first `points` points into `rows`.
    pub(crate) fn read_rows(&mut self, points: u64, rows: &mut Vec<u8>) -> Result<(), LogError> {
        rows.clear();
        match &self.head.body {
            Body::Rows { data_at } => {
                let count = points.saturating_mul(self.head.layout.point_bytes().into());
                let at = *data_at;
                fill(&self.known.path, &mut self.input, at, count, rows)
            }
            Body::Text { .. } => {
                let (whole, cut) = self.read_text(points, rows, false)?;
                match cut {
                    Some(cut) if whole < points => {
                        Err(LogError::malformed(&self.known.path, cut.place, cut.what))
                    }
                    _ => Ok(()),
                }
            }
            Body::Packed(packed) => packed.read_rows(&self.known.path, &mut self.input, rows),
            Body::Las { .. } => {
                las::read_rows(&self.known.path, &self.count, points, &self.head.layout, rows)
            }
        }
    }

    /// Reads lines into `rows`, as many as are well; with `drop_rows` only to count them.
    fn read_text(
        &mut self,
        points: u64,
        rows: &mut Vec<u8>,
        drop_rows: bool,
    ) -> Result<(u64, Option<Cut>), LogError> {
        let Body::Text { data_at, lines_before, skipped, rows: text } = &self.head.body else {
            return Ok((0, None));
        };
        let io = |e| LogError::io(&self.known.path, "read", e);
        self.input.seek(SeekFrom::Start(*data_at)).map_err(io)?;
        let claimed = points.saturating_add(*skipped);
        let (mut number, mut row, mut line) = (*lines_before, 0, Vec::new());
        let cut = |row: u64, number: u64, what: &str| {
            let whole = row.saturating_sub(*skipped);
            let [all, kept] = [points, whole].map(thousands);
            let what = format!("{what}: of {all} points the {kept} before it are kept");
            Ok((whole, Some(Cut { place: PlaceInFile::Line(number), what })))
        };
        let mut ended = true;
        while row < claimed {
            number += 1;
            line.clear();
            match read_data_line(&mut self.input, &mut line) {
                Ok(Some(with_end)) if line.trim_ascii().is_empty() => ended = with_end,
                Ok(Some(with_end)) => {
                    ended = with_end;
                    if row >= *skipped {
                        if drop_rows {
                            rows.clear();
                        }
                        if let Err(problem) = text.push(&line, rows) {
                            return cut(row, number, &problem);
                        }
                    }
                    row += 1;
                }
                // A last line without its end may be cut in a number.
                Ok(None) if !ended && row > *skipped => {
                    return cut(row - 1, number - 1, "the file ends within this line");
                }
                Ok(None) => return cut(row, number, "the file ends"),
                Err(error) if error.kind() == io::ErrorKind::InvalidData => {
                    return cut(row, number, &error.to_string());
                }
                Err(error) => return Err(io(error)),
            }
        }
        Ok((points, None))
    }
}

/// A line of points, its end left out; whether it had one. `None` at the end of the file.
fn read_data_line(input: &mut impl BufRead, line: &mut Vec<u8>) -> io::Result<Option<bool>> {
    const MOST_BYTES: u64 = crate::file::MAX_LINE_BYTES;
    let count = input.by_ref().take(MOST_BYTES).read_until(b'\n', line)? as u64;
    let with_end = line.pop_if(|last| *last == b'\n').is_some();
    if count == MOST_BYTES && !with_end {
        let problem = format!("a line longer than {MOST_BYTES} bytes");
        return Err(io::Error::new(io::ErrorKind::InvalidData, problem));
    }
    Ok((count > 0).then_some(with_end))
}

fn bin_head(length: u64, layout: Option<&Layout>) -> Head {
    let layout = layout.cloned().unwrap_or_else(|| Layout::of_nothing(Vec::new(), false, 1));
    // A part of a point behind the whole ones is a point that was claimed.
    let points = length.div_ceil(layout.point_bytes().into());
    Head { layout, points, body: Body::Rows { data_at: 0 } }
}

fn whole_rows(data_at: u64, layout: &Layout, claimed: u64, length: u64) -> (u64, Option<Cut>) {
    let point_bytes = u64::from(layout.point_bytes());
    let there = length.saturating_sub(data_at).checked_div(point_bytes).unwrap_or(claimed);
    if there >= claimed {
        return (claimed, None);
    }
    let place = PlaceInFile::Byte(data_at + there * point_bytes);
    let all = thousands(claimed);
    let what = format!(
        "the file ends at byte {length}, within point {there} of {all}, {point_bytes} bytes each: the points before it are kept"
    );
    (there, Some(Cut { place, what }))
}
