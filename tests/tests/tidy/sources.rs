//! The sources and documents of the workspace.

use std::path::{Path, PathBuf};

/// The root of the workspace.
pub(crate) fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().to_path_buf()
}

/// The folders of the crates, sorted.
pub(crate) fn crate_folders() -> Vec<PathBuf> {
    let folder = std::fs::read_dir(workspace().join("crates")).unwrap();
    let mut folders: Vec<PathBuf> = folder.map(|entry| entry.unwrap().path()).collect();
    folders.sort();
    folders
}

/// The name of a crate, from its folder.
pub(crate) fn name_of(folder: &Path) -> String {
    folder.file_name().unwrap().to_str().unwrap().to_owned()
}

/// Every Rust file below a folder.
pub(crate) fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files.extend(rust_files(&path));
        } else if path.extension().is_some_and(|e| e == "rs") {
            files.push(path);
        }
    }
    files
}

/// Every line of code (not of tests at a file's end, nor comments) in the `src` of the crates, with the name of
/// the crate and the file.
pub(crate) fn code_lines() -> Vec<(String, PathBuf, String)> {
    let mut lines = Vec::new();
    for folder in crate_folders() {
        for file in rust_files(&folder.join("src")) {
            // A file of tests.
            if file.file_name().is_some_and(|name| name == "tests.rs") {
                continue;
            }
            let text = std::fs::read_to_string(&file).unwrap();
            let file_lines: Vec<&str> = text.lines().collect();
            // A module of tests ends a file; a test's helper that is only declared does not.
            let opens = |pair: &[&str]| pair[0].trim() == "#[cfg(test)]" && pair[1].ends_with('{');
            let tests = file_lines.windows(2).position(opens).unwrap_or(file_lines.len());
            let code = file_lines[..tests].iter();
            let code = code.filter(|line| !line.trim_start().starts_with("//"));
            lines.extend(code.map(|line| (name_of(&folder), file.clone(), (*line).to_owned())));
        }
    }
    assert!(lines.len() > 3000, "the crates were to be found");
    lines
}
