//! Rows of a PLY element with lists in it, in text and in bytes.

use crate::file::{read_line, shorten};
use crate::geometry::cloud::ply_header::{PlyElement, PlyProperty, kind_of};
use crate::points::RawTime;
use crate::{LogError, PlaceInFile};
use std::io::{self, BufRead, Read};
use std::path::Path;

/// The names that the corners of a face go by.
pub(super) const CORNERS: [&str; 2] = ["vertex_indices", "vertex_index"];

fn has_corners(name: &str) -> bool {
    CORNERS.contains(&name)
}

/// Lines with something in them.
pub(super) struct Lines<'a, R> {
    pub(super) path: &'a Path,
    pub(super) input: R,
    /// Of the last line read.
    pub(super) number: u64,
    pub(super) line: Vec<u8>,
}

impl<R: BufRead> Lines<'_, R> {
    pub(super) fn next(&mut self) -> Result<PlaceInFile, LogError> {
        loop {
            self.number += 1;
            let place = PlaceInFile::Line(self.number);
            let wrong = |problem: String| LogError::malformed(self.path, place, problem);
            if read_line(&mut self.input, &mut self.line).map_err(|e| wrong(e.to_string()))?.is_none() {
                return Err(wrong("the file ends before its last face".into()));
            }
            if !self.line.is_empty() {
                return Ok(place);
            }
        }
    }

    /// Reads a row and hands over the corners in it.
    pub(super) fn row<E: From<LogError>>(
        &mut self,
        element: &PlyElement,
        mut corner: impl FnMut(PlaceInFile, i64) -> Result<(), E>,
    ) -> Result<(), E> {
        let place = self.next()?;
        let text = String::from_utf8_lossy(&self.line);
        let mut words = text.split_ascii_whitespace();
        let mut next = || words.next().unwrap_or_default();
        let whole = |word: &str| {
            let problem = || format!("`{}` is no count or index of a face", shorten(word));
            word.parse::<i64>().map_err(|_| LogError::malformed(self.path, place, problem()))
        };
        for property in &element.properties {
            match property {
                PlyProperty::Scalar { .. } => drop(next()),
                PlyProperty::List { name, .. } => {
                    // No line has more words than bytes.
                    let count = whole(next())?.min(self.line.len() as i64);
                    for _ in 0..count {
                        let word = next();
                        if has_corners(name) {
                            corner(place, whole(word)?)?;
                        }
                    }
                }
            }
        }
        Ok(())
    }
}

/// Bytes, and where in the file they are.
pub(super) struct Bytes<'a, R> {
    pub(super) path: &'a Path,
    pub(super) input: R,
    /// Of the next byte.
    pub(super) at: u64,
    pub(super) big_endian: bool,
}

impl<R: Read> Bytes<'_, R> {
    /// Reads a row and hands over the corners in it.
    pub(super) fn row<E: From<LogError>>(
        &mut self,
        element: &PlyElement,
        mut corner: impl FnMut(PlaceInFile, i64) -> Result<(), E>,
    ) -> Result<(), E> {
        for property in &element.properties {
            match property {
                PlyProperty::Scalar { bytes } => self.skip(*bytes)?,
                PlyProperty::List { name, count, item } => {
                    let items = self.whole(name, count)?;
                    if has_corners(name) {
                        for _ in 0..items {
                            let place = PlaceInFile::Byte(self.at);
                            corner(place, self.whole(name, item)?)?;
                        }
                    } else {
                        let number = kind_of(item).ok_or_else(|| self.unknown(name, item))?;
                        self.skip((items.max(0) as u64).saturating_mul(number.bytes().into()))?;
                    }
                }
            }
        }
        Ok(())
    }

    fn skip(&mut self, bytes: u64) -> Result<(), LogError> {
        let skipped = io::copy(&mut self.input.by_ref().take(bytes), &mut io::sink());
        if skipped.map_err(|e| LogError::io(self.path, "read", e))? != bytes {
            return Err(self.ends());
        }
        self.at += bytes;
        Ok(())
    }

    /// A whole number of the type that the header names.
    fn whole(&mut self, list: &str, kind: &str) -> Result<i64, LogError> {
        let Some(number) = kind_of(kind).filter(|number| !number.is_float()) else {
            return Err(self.unknown(list, kind));
        };
        let (bytes, mut row) = (number.bytes() as usize, [0; 8]);
        match self.input.read_exact(&mut row[..bytes]) {
            Err(e) if e.kind() == io::ErrorKind::UnexpectedEof => return Err(self.ends()),
            Err(e) => return Err(LogError::io(self.path, "read", e)),
            Ok(()) => self.at += bytes as u64,
        }
        match number.read(&row, 0, self.big_endian) {
            Some(RawTime::Integer(value)) => Ok(value),
            _ => Err(self.unknown(list, kind)),
        }
    }

    fn ends(&self) -> LogError {
        LogError::malformed(self.path, PlaceInFile::Byte(self.at), "the file ends before its last face")
    }

    fn unknown(&self, list: &str, kind: &str) -> LogError {
        let problem = format!("the list `{}` has the type `{}` in it", shorten(list), shorten(kind));
        LogError::malformed(self.path, PlaceInFile::Byte(self.at), problem)
    }
}
