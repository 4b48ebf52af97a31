//! The faces of a PLY file.

use super::fans::{Fans, MeshFormat, MeshSummary, Sink, vertex};
use super::ply_rows::{Bytes, CORNERS, Lines};
use crate::file::open_sized;
use crate::geometry::cloud::ply_cloud::read_vertices;
use crate::geometry::cloud::ply_header::{Encoding, PlyHeader, PlyProperty, read_header};
use crate::{LogError, PlaceInFile};
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

fn open(path: &Path) -> Result<(BufReader<File>, PlyHeader, u64), LogError> {
    let (mut input, length) = open_sized(path)?;
    let header = read_header(&mut input).map_err(|e| e.in_file(path))?;
    Ok((input, header, length))
}

/// Whether a PLY file says that it has faces.
pub(super) fn has_faces(path: &Path) -> Result<bool, LogError> {
    let (_, header, _) = open(path)?;
    Ok(header.after.iter().any(|element| element.name == "face" && element.rows > 0))
}

/// Reads the faces of a PLY file row by row; elements behind them are never reached.
pub(super) fn read<E: From<LogError>>(path: &Path, sink: &mut Sink<'_, E>) -> Result<MeshSummary, E> {
    let (mut input, header, length) = open(path)?;
    let Some(faces_at) = header.after.iter().position(|element| element.name == "face") else {
        let problem = "no element `face` behind the vertices: a cloud, not a mesh";
        return Err(LogError::malformed(path, PlaceInFile::Line(header.lines), problem).into());
    };
    let faces = &header.after[faces_at];
    let is_corners = |property: &PlyProperty| matches!(property, PlyProperty::List { name, .. } if CORNERS.contains(&name.as_str()));
    if !faces.properties.iter().any(is_corners) {
        let problem = format!("the faces lack the list `{}`", CORNERS.join("` or `"));
        return Err(LogError::malformed(path, PlaceInFile::Line(header.lines), problem).into());
    }
    let mut vertices: Vec<[f64; 3]> = Vec::new();
    let last_line = read_vertices(path, &mut input, &header, length, |vertex| {
        vertices.push(vertex);
        Ok::<(), E>(())
    })?;
    let mut fans = Fans::new(sink);
    let skipped = &header.after[..faces_at];
    if header.encoding == Encoding::Ascii {
        let rows = skipped.iter().fold(0_u64, |sum, element| sum.saturating_add(element.rows));
        let mut lines = Lines { path, input, number: last_line, line: Vec::new() };
        for _ in 0..rows {
            lines.next()?;
        }
        for _ in 0..faces.rows {
            lines.row(faces, |place, index| fans.corner(vertex(path, place, &vertices, index)?))?;
            fans.end_face();
        }
    } else {
        let before: u64 = header.before.iter().map(|&(rows, bytes)| rows * bytes).sum();
        let at = header.bytes + before + header.vertices * header.vertex_bytes as u64;
        let mut bytes = Bytes { path, input, at, big_endian: header.encoding == Encoding::BigEndian };
        for element in skipped.iter().filter(|element| !element.properties.is_empty()) {
            for _ in 0..element.rows {
                bytes.row(element, |_, _| Ok::<(), E>(()))?;
            }
        }
        for _ in 0..faces.rows {
            bytes.row(faces, |place, index| fans.corner(vertex(path, place, &vertices, index)?))?;
            fans.end_face();
        }
    }
    fans.finish(MeshFormat::Ply, vertices.len() as u64)
}
