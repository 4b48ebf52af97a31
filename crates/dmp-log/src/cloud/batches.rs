//! Points of a cloud, handed over in batches.

use crate::{LogError, PlaceInFile};
use std::path::Path;

/// Most points handed over at once.
pub(super) const BATCH: usize = 65_536;

/// Collects points, brings them to metres and hands them over in batches.
pub(super) struct Batches<'a, F> {
    scale: [f64; 3],
    sink: &'a mut F,
    batch: Vec<[f64; 3]>,
    pub(super) points: u64,
}

impl<'a, F> Batches<'a, F> {
    pub(super) fn scaled(sink: &'a mut F, scale: [f64; 3]) -> Self {
        Self { scale, sink, batch: Vec::with_capacity(BATCH), points: 0 }
    }

    pub(super) fn push<E>(&mut self, point: [f64; 3]) -> Result<(), E>
    where
        F: FnMut(&[[f64; 3]]) -> Result<(), E>,
    {
        let ([x, y, z], [sx, sy, sz]) = (point, self.scale);
        self.batch.push([x * sx, y * sy, z * sz]);
        self.points += 1;
        if self.batch.len() == BATCH { self.flush() } else { Ok(()) }
    }

    pub(super) fn flush<E>(&mut self) -> Result<(), E>
    where
        F: FnMut(&[[f64; 3]]) -> Result<(), E>,
    {
        if !self.batch.is_empty() {
            (self.sink)(&self.batch)?;
            self.batch.clear();
        }
        Ok(())
    }
}

/// An error in a file at a place.
pub(super) fn broken<E: From<LogError>>(path: &Path, place: PlaceInFile, problem: impl Into<String>) -> E {
    LogError::malformed(path, place, problem).into()
}
