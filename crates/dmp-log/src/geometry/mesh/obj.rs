//! The faces of an OBJ file.

use super::fans::{Fans, MeshFormat, MeshSummary, Sink, vertex};
use crate::file::{read_line, shorten};
use crate::{LogError, PlaceInFile};
use dmp_disk::open_input;
use std::io::BufReader;
use std::path::Path;

/// Reads the `v` and `f` lines of an OBJ file; everything else (normals, textures, groups, lines) is passed
/// over. A face may only name vertices above it.
pub(super) fn read<E: From<LogError>>(path: &Path, sink: &mut Sink<'_, E>) -> Result<MeshSummary, E> {
    let file = open_input(path).map_err(|e| LogError::io(path, "open", e))?;
    let mut input = BufReader::with_capacity(1 << 16, file);
    let (mut vertices, mut line, mut number, mut faces) = (Vec::new(), Vec::new(), 0, 0_u64);
    let mut fans = Fans::new(sink);
    loop {
        number += 1;
        let place = PlaceInFile::Line(number);
        let wrong = |problem: String| LogError::malformed(path, place, problem);
        if read_line(&mut input, &mut line).map_err(|e| wrong(e.to_string()))?.is_none() {
            break;
        }
        let text = String::from_utf8_lossy(&line);
        let mut words = text.split_ascii_whitespace();
        match words.next() {
            Some("v") => {
                let mut coordinate = || {
                    let word = words.next().unwrap_or_default();
                    let value = word.parse::<f64>();
                    value.map_err(|_| wrong(format!("`{}` is no coordinate", shorten(word))))
                };
                vertices.push([coordinate()?, coordinate()?, coordinate()?]);
            }
            Some("f") => {
                faces += 1;
                for word in words.take_while(|word| !word.starts_with('#')) {
                    let index = index_of(word, vertices.len()).ok_or_else(|| {
                        wrong(format!("`{}` names no vertex (it may only name those above)", shorten(word)))
                    })?;
                    fans.corner(vertex(path, place, &vertices, index)?)?;
                }
                fans.end_face();
            }
            _ => {}
        }
    }
    if faces == 0 {
        let problem = format!("{} vertices and no face: not a mesh", vertices.len());
        return Err(LogError::malformed(path, PlaceInFile::WholeFile, problem).into());
    }
    fans.finish(MeshFormat::Obj, vertices.len() as u64)
}

/// `7`, `7/1`, `7/1/2`, `7//2`, `-1`: counted from 1, or back from the latest. Answers from 0.
fn index_of(word: &str, vertices: usize) -> Option<i64> {
    let vertex = word.split('/').next()?.parse::<i64>().ok()?;
    let index = if vertex < 0 { (vertices as i64).checked_add(vertex)? } else { vertex - 1 };
    (0..vertices as i64).contains(&index).then_some(index)
}
