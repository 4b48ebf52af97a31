//! Circles among the files of a crate: files that import each other in a loop.

mod graph;
mod read;
mod resolve;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::path::PathBuf;

use crate::sources::{crate_folders, rust_files, workspace};

/// The text of each file of a package, by its path.
type Sources = BTreeMap<PathBuf, String>;

#[test]
fn no_files_of_a_crate_import_each_other_in_a_loop() {
    let mut folders = crate_folders();
    folders.push(workspace().join("xtask"));
    let mut circles = Vec::new();
    for folder in folders {
        let files = rust_files(&folder.join("src")).into_iter();
        let sources: Sources = files
            .map(|file| {
                let text = std::fs::read_to_string(&file).unwrap();
                (file.strip_prefix(workspace()).unwrap().to_path_buf(), text)
            })
            .collect();
        circles.extend(graph::circles(&resolve::imports(&sources)));
    }
    let found: Vec<String> =
        circles.iter().enumerate().map(|(i, circle)| format!("circle {}: {circle}", i + 1)).collect();
    assert!(found.is_empty(), "files that import each other in a loop:\n{}", found.join("\n"));
}
