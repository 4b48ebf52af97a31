//! Points of a cloud, handed over in batches; those of a text, read line by line.

use crate::file::{read_line, shorten};
use crate::{LogError, PlaceInFile};
use dmp_lengths::thousands;
use std::io::BufRead;
use std::path::Path;

/// Most points handed over at once.
pub(super) const BATCH: usize = 65_536;

/// What takes the batches.
pub(super) type Sink<'a, E> = dyn FnMut(&[[f64; 3]]) -> Result<(), E> + 'a;

/// Collects points, brings them to metres and hands them over in batches.
pub(super) struct Batches<'a, 'b, E> {
    scale: [f64; 3],
    sink: &'a mut Sink<'b, E>,
    batch: Vec<[f64; 3]>,
    pub(super) points: u64,
}

impl<'a, 'b, E> Batches<'a, 'b, E> {
    pub(super) fn scaled(sink: &'a mut Sink<'b, E>, scale: [f64; 3]) -> Self {
        Self { scale, sink, batch: Vec::with_capacity(BATCH), points: 0 }
    }

    pub(super) fn push(&mut self, point: [f64; 3]) -> Result<(), E> {
        let ([x, y, z], [sx, sy, sz]) = (point, self.scale);
        self.batch.push([x * sx, y * sy, z * sz]);
        self.points += 1;
        if self.batch.len() == BATCH { self.flush() } else { Ok(()) }
    }

    pub(super) fn flush(&mut self) -> Result<(), E> {
        if !self.batch.is_empty() {
            (self.sink)(&self.batch)?;
            self.batch.clear();
        }
        Ok(())
    }
}

pub(super) fn broken<E: From<LogError>>(path: &Path, place: PlaceInFile, problem: impl Into<String>) -> E {
    LogError::malformed(path, place, problem).into()
}

/// The lines of a text, one for a point, behind its header and rows of other things.
pub(super) struct TextPoints {
    pub(super) lines_before: u64,
    pub(super) skipped: u64,
    pub(super) points: u64,
    /// Those of x, y and z.
    pub(super) columns: [usize; 3],
    /// What the file calls its points.
    pub(super) name: &'static str,
}

impl TextPoints {
    /// Hands over each point. Answers the number of the last line read.
    pub(super) fn read<E: From<LogError>>(
        &self,
        path: &Path,
        input: &mut impl BufRead,
        mut each: impl FnMut([f64; 3]) -> Result<(), E>,
    ) -> Result<u64, E> {
        let (mut number, mut row, mut line) = (self.lines_before, 0_u64, Vec::new());
        while row < self.points.saturating_add(self.skipped) {
            number += 1;
            let place = PlaceInFile::Line(number);
            let read = read_line(input, &mut line);
            if read.map_err(|e| LogError::malformed(path, place, e.to_string()))?.is_none() {
                let [got, claimed] = [row.saturating_sub(self.skipped), self.points].map(thousands);
                let problem = format!("the file ends after {got} of {claimed} {}", self.name);
                return Err(broken(path, place, problem));
            }
            if line.is_empty() {
                continue;
            }
            row += 1;
            if row > self.skipped {
                let text = String::from_utf8_lossy(&line);
                let words: Vec<&str> = text.split_ascii_whitespace().collect();
                let mut point = [0.0; 3];
                for (coordinate, &column) in point.iter_mut().zip(&self.columns) {
                    let word = words.get(column).copied().unwrap_or_default();
                    *coordinate = word.parse().map_err(|_| {
                        let what = format!("`{}` in column {} is not a number", shorten(word), column + 1);
                        broken::<E>(path, place, what)
                    })?;
                }
                each(point)?;
            }
        }
        Ok(number)
    }
}
