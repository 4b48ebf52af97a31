//! Point clouds given as maps.

mod las_cloud;
mod las_header;
pub(crate) mod ply_cloud;
pub(crate) mod ply_header;

use crate::{LogError, Place};
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Most points handed over at once.
const BATCH: usize = 65_536;

/// The formats of clouds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum CloudFormat {
    /// LAS.
    Las,
    /// Compressed LAS.
    Laz,
    /// PLY with a `vertex` element.
    Ply,
}

impl CloudFormat {
    /// Its name for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Las => "LAS",
            Self::Laz => "LAZ",
            Self::Ply => "PLY",
        }
    }
}

/// What was read of a cloud.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CloudSummary {
    /// The file's format.
    pub format: CloudFormat,
    /// Points handed over, those that are not finite included.
    pub points: u64,
}

/// Reads the points of a LAS, LAZ or PLY file, in metres of the file's own frame, and hands them to
/// `sink` in batches of at most 65,536, in the file's order. Memory does not grow with the file.
///
/// LAS, LAZ and PLY have no checksums: damaged coordinates in a file that is otherwise sound cannot be told
/// from true ones. A LAZ decoder that stumbles over them may print a panic message on the way to the error.
///
/// The sink's own error comes back as it is; `E` only has to be able to hold a [`LogError`].
///
/// # Errors
/// When the file cannot be read, is in no format known here, or has fewer points than it claims; and
/// the first error of `sink`.
pub fn read_cloud<E: From<LogError>>(
    path: &Path,
    mut sink: impl FnMut(&[[f64; 3]]) -> Result<(), E>,
) -> Result<CloudSummary, E> {
    let mut start = Vec::new();
    let file = File::open(path).map_err(|e| LogError::io(path, "open", e))?;
    file.take(4).read_to_end(&mut start).map_err(|e| LogError::io(path, "read", e))?;
    match start.as_slice() {
        b"LASF" => las_cloud::read(path, &mut sink),
        [b'p', b'l', b'y', b'\n' | b'\r'] => ply_cloud::read(path, &mut sink),
        _ => {
            let looked_for = format!("looked for a LAS, LAZ or PLY cloud; the file starts with {start:02x?}");
            Err(LogError::UnknownFormat { path: path.into(), looked_for }.into())
        }
    }
}

/// Collects points and hands them over in batches.
struct Batches<'a, F> {
    sink: &'a mut F,
    batch: Vec<[f64; 3]>,
    points: u64,
}

impl<'a, F> Batches<'a, F> {
    fn new(sink: &'a mut F) -> Self {
        Self { sink, batch: Vec::with_capacity(BATCH), points: 0 }
    }

    fn push<E>(&mut self, point: [f64; 3]) -> Result<(), E>
    where
        F: FnMut(&[[f64; 3]]) -> Result<(), E>,
    {
        self.batch.push(point);
        self.points += 1;
        if self.batch.len() == BATCH { self.flush() } else { Ok(()) }
    }

    fn flush<E>(&mut self) -> Result<(), E>
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
fn broken<E: From<LogError>>(path: &Path, place: Place, problem: impl Into<String>) -> E {
    LogError::malformed(path, place, problem).into()
}
