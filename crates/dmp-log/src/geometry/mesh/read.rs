//! Reading a mesh of any format.

use super::fans::MeshSummary;
use super::{obj, ply_mesh};
use crate::LogError;
use crate::file::start_of;
use std::path::Path;

/// Whether a file is a mesh: a PLY file with faces, or a file whose name ends in `.obj`. Everything else is
/// for [`read_cloud`](crate::read_cloud) to read or to refuse.
///
/// # Errors
/// When the file cannot be read, or a PLY header makes no sense.
pub fn is_mesh(path: &Path) -> Result<bool, LogError> {
    let start = start_of(path)?;
    if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("obj")) {
        return Ok(true);
    }
    Ok(matches!(start.as_slice(), [b'p', b'l', b'y', b'\n' | b'\r', ..]) && ply_mesh::has_faces(path)?)
}

/// Reads the triangles of a PLY or OBJ mesh, in metres of the file's own frame, and hands them to `sink` in
/// batches of at most 16,384, in the file's order. Polygons are cut into triangles from their first corner.
///
/// The vertices are held in memory, 24 bytes each; the faces are not.
///
/// # Errors
/// When the file cannot be read, is no mesh, ends early, or a face names a vertex that is not there; and
/// the first error of `sink`.
pub fn read_mesh<E: From<LogError>>(
    path: &Path,
    mut sink: impl FnMut(&[[[f64; 3]; 3]]) -> Result<(), E>,
) -> Result<MeshSummary, E> {
    if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("obj")) {
        obj::read(path, &mut sink)
    } else {
        ply_mesh::read(path, &mut sink)
    }
}
