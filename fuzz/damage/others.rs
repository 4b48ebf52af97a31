//! The seeds that other software wrote: files below `tests/conformance`, found by patterns.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// The files that a pattern names, with their paths below `tests/conformance`, sorted. `*` stands for any part of a name; names
/// with one of the parts behind ` -` do not belong to it: `clouds/*.ply -mesh`.
pub(crate) fn others(pattern: &str) -> io::Result<Vec<(String, Vec<u8>)>> {
    let mut words = pattern.split(" -");
    let (folder, name) = words.next().and_then(|path| path.rsplit_once('/')).unwrap_or_default();
    let excluded: Vec<&str> = words.collect();
    let root: PathBuf = [env!("CARGO_MANIFEST_DIR"), ".."].iter().collect();
    // Of a package of the workspace, or of one in `crates`.
    let near = root.join("tests/conformance");
    let root = if near.is_dir() { near } else { root.join("../tests/conformance") };
    let mut found = Vec::new();
    for entry in fs::read_dir(root.join(folder))? {
        let file = entry?.file_name().to_string_lossy().into_owned();
        let path = format!("{folder}/{file}");
        if is_named(&file, name) && !excluded.iter().any(|part| file.contains(part)) {
            found.push((path.clone(), fs::read(root.join(Path::new(&path)))?));
        }
    }
    found.sort();
    if found.is_empty() {
        return Err(io::Error::other(format!("no file of other software is named {pattern}")));
    }
    Ok(found)
}

fn is_named(name: &str, pattern: &str) -> bool {
    let Some((start, rest)) = pattern.split_once('*') else { return name == pattern };
    let Some(behind) = name.strip_prefix(start) else { return false };
    rest.is_empty() || (0..=behind.len()).any(|at| behind.get(at..).is_some_and(|end| is_named(end, rest)))
}
