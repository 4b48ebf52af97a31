//! Triangles made of the polygons of a mesh.

use crate::{LogError, PlaceInFile};
use std::path::Path;

/// Most triangles handed over at once.
const BATCH: usize = 16_384;

/// The formats of meshes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum MeshFormat {
    /// PLY with a `face` element.
    Ply,
    /// Wavefront OBJ.
    Obj,
}

impl MeshFormat {
    /// Its name for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ply => "PLY mesh",
            Self::Obj => "OBJ mesh",
        }
    }
}

/// What was read of a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MeshSummary {
    /// The file's format.
    pub format: MeshFormat,
    /// Vertices, used or not.
    pub vertices: u64,
    /// Triangles handed over; a polygon of n corners gives n − 2.
    pub triangles: u64,
    /// Faces of fewer than three corners, which were passed over.
    pub thin_faces: u64,
}

/// What takes the batches of triangles.
pub(super) type Sink<'a, E> = dyn FnMut(&[[[f64; 3]; 3]]) -> Result<(), E> + 'a;

/// Makes triangles of polygons and hands them over in batches.
pub(super) struct Fans<'a, 'b, E> {
    sink: &'a mut Sink<'b, E>,
    batch: Vec<[[f64; 3]; 3]>,
    /// First and latest corner of the polygon at hand, and how many it has so far.
    polygon: ([f64; 3], [f64; 3], u64),
    triangles: u64,
    thin_faces: u64,
}

impl<'a, 'b, E> Fans<'a, 'b, E> {
    pub(super) fn new(sink: &'a mut Sink<'b, E>) -> Self {
        Self { sink, batch: Vec::new(), polygon: ([0.0; 3], [0.0; 3], 0), triangles: 0, thin_faces: 0 }
    }

    /// One more corner of the polygon at hand.
    pub(super) fn corner(&mut self, corner: [f64; 3]) -> Result<(), E> {
        let (first, latest, count) = self.polygon;
        self.polygon = (if count == 0 { corner } else { first }, corner, count + 1);
        if count < 2 {
            return Ok(());
        }
        self.batch.push([first, latest, corner]);
        self.triangles += 1;
        if self.batch.len() == BATCH { self.flush() } else { Ok(()) }
    }

    /// The polygon at hand has all its corners.
    pub(super) fn end_face(&mut self) {
        self.thin_faces += u64::from(self.polygon.2 < 3);
        self.polygon.2 = 0;
    }

    pub(super) fn finish(mut self, format: MeshFormat, vertices: u64) -> Result<MeshSummary, E> {
        self.flush()?;
        let Self { triangles, thin_faces, .. } = self;
        Ok(MeshSummary { format, vertices, triangles, thin_faces })
    }

    fn flush(&mut self) -> Result<(), E> {
        if !self.batch.is_empty() {
            (self.sink)(&self.batch)?;
            self.batch.clear();
        }
        Ok(())
    }
}

/// The vertex that a face names, counted from 0.
pub(super) fn vertex<E: From<LogError>>(
    path: &Path,
    place: PlaceInFile,
    vertices: &[[f64; 3]],
    index: i64,
) -> Result<[f64; 3], E> {
    let found = usize::try_from(index).ok().and_then(|index| vertices.get(index));
    found.copied().ok_or_else(|| {
        let problem = format!("a face names vertex {index} (from 0) of {}", vertices.len());
        LogError::malformed(path, place, problem).into()
    })
}
