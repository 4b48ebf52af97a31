//! Folders of tries: writing files into them, finding what is in them.

use std::path::Path;

use tempfile::TempDir;

use super::seed::File;

/// Writes files into a folder, which is made.
pub(crate) fn write(files: &[File], folder: &Path) -> anyhow::Result<()> {
    for file in files {
        let path = folder.join(&file.path);
        if let Some(parent) = path.parent() {
            std::fs::create_dir_all(parent)?;
        }
        std::fs::write(path, &file.bytes)?;
    }
    Ok(())
}

/// A folder of its own for a try, in memory where the system has a place for that.
pub(crate) fn folder() -> std::io::Result<TempDir> {
    let memory = Path::new("/dev/shm");
    if memory.is_dir() { TempDir::new_in(memory).or_else(|_| TempDir::new()) } else { TempDir::new() }
}

/// Every file below a folder, with `/`; of empty folders themselves.
pub(crate) fn paths(folder: &Path) -> Vec<String> {
    let mut found = Vec::new();
    let mut open = vec![String::new()];
    while let Some(at) = open.pop() {
        let entries: Vec<_> = std::fs::read_dir(folder.join(&at)).into_iter().flatten().flatten().collect();
        if entries.is_empty() && !at.is_empty() {
            found.push(at.clone());
        }
        for entry in entries {
            let name = entry.file_name().to_string_lossy().into_owned();
            let path = if at.is_empty() { name } else { format!("{at}/{name}") };
            if entry.file_type().is_ok_and(|kind| kind.is_dir()) { open.push(path) } else { found.push(path) }
        }
    }
    found.sort();
    found
}
