//! What a result depends on: the contents of the log, of the trajectories, and the settings.

use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use dmp_disk::{ContentHash, ContentMemo};
use dmp_log::{Companions, is_of_log};

use super::paths::Source;
use super::plan::PlannedLog;
use crate::console::Common;

/// How deep in a folder the files of a log lie.
const DEPTH: u32 = 3;

/// The name of a log's result: it changes with the version of this program, with what any file that is read holds, with the
/// names of the versions and with the settings, and with nothing else.
pub(super) fn key(log: &PlannedLog, memo: &mut ContentMemo, common: &Common) -> anyhow::Result<ContentHash> {
    let mut parts = vec![format!("dmp suite 1, dmp {}", env!("CARGO_PKG_VERSION"))];
    parts.push(format!("log {}", files(&log.path, memo, common)?));
    for (version, run) in &log.runs {
        let held = match Source::of(run).and_then(Source::file) {
            Some(file) => {
                // What stands behind the file is its topic.
                let topic = run.strip_prefix(&file.display().to_string()).unwrap_or_default();
                format!("{topic} {}", files(&file, memo, common)?)
            }
            None => run.clone(),
        };
        parts.push(format!("run {version}: {held}"));
    }
    for option in &log.options {
        let held = option.file.as_ref().map_or(Ok(String::new()), |file| files(file, memo, common))?;
        parts.push(format!("option {} {held}", option.setting));
    }
    Ok(ContentHash::of(parts.join("\0").as_bytes()))
}

/// What an input holds, files beside and below it that are read with it too: their names within it and their hashes.
fn files(input: &Path, memo: &mut ContentMemo, common: &Common) -> anyhow::Result<String> {
    let mut parts = Vec::new();
    for (role, path) in read_with(input) {
        let go_on = || common.host.go_on().map_err(io::Error::other);
        let hashed = memo.hash(&path, go_on);
        common.host.go_on()?;
        let hash = hashed.with_context(|| format!("{}: cannot read", path.display()))?;
        parts.push(format!("{role} {hash}"));
    }
    Ok(ContentHash::of(parts.join("\n").as_bytes()).to_string())
}

/// Files with what they are to the input, in an order that is always the same.
fn read_with(input: &Path) -> BTreeSet<(String, PathBuf)> {
    let mut found = Vec::new();
    let companions = if input.is_dir() {
        below(input, DEPTH, &mut found);
        Companions::of_folder(input)
    } else {
        found.push(input.to_path_buf());
        Companions::of_file(input)
    };
    found.extend(companions.files.into_iter().filter(|file| file.is_file()));
    for folder in companions.folders {
        below(&folder, 0, &mut found);
    }
    let base = input.canonicalize().unwrap_or_else(|_| input.to_path_buf());
    let named = |path: PathBuf| {
        let path = path.canonicalize().unwrap_or(path);
        let role = if path == base {
            // Not its name, but what may say its format.
            path.extension().map_or(String::new(), |extension| format!(".{}", extension.to_string_lossy()))
        } else if let Ok(inside) = path.strip_prefix(&base) {
            inside.to_string_lossy().into_owned()
        } else {
            let depth =
                base.ancestors().skip(1).position(|folder| path.starts_with(folder)).unwrap_or_default();
            format!("{depth}/{}", path.file_name().unwrap_or_default().to_string_lossy())
        };
        (role, path)
    };
    found.into_iter().map(named).collect()
}

/// The files of a log in a folder.
fn below(folder: &Path, depth: u32, found: &mut Vec<PathBuf>) {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    for path in entries {
        if path.is_dir() {
            if depth > 0 {
                below(&path, depth - 1, found);
            }
        } else if is_of_log(&path) {
            found.push(path);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn log(folder: &Path) -> PlannedLog {
        PlannedLog {
            name: "any".into(),
            path: folder.join("a.mcap"),
            runs: vec![("old".into(), folder.join("old.tum").display().to_string())],
            missing: Vec::new(),
            options: Vec::new(),
        }
    }

    fn common() -> Common {
        Common { quiet: true, ..Common::default() }
    }

    #[test]
    fn a_result_is_known_by_contents_alone() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
        write("a.mcap", "log");
        write("old.tum", "run");
        let key = |log: &PlannedLog| key(log, &mut ContentMemo::new(), &common()).unwrap();
        let first = key(&log(folder.path()));
        // Another name, another place, other times.
        let moved = tempfile::tempdir().unwrap();
        fs::write(moved.path().join("b.mcap"), "log").unwrap();
        fs::write(moved.path().join("x.tum"), "run").unwrap();
        let mut elsewhere = log(moved.path());
        elsewhere.path = moved.path().join("b.mcap");
        elsewhere.runs[0].1 = moved.path().join("x.tum").display().to_string();
        elsewhere.name = "other".into();
        assert_eq!(key(&elsewhere), first);
        let mut keys = BTreeSet::from([first]);
        write("old.tum", "ran");
        keys.insert(key(&log(folder.path())));
        write("times.txt", "0");
        keys.insert(key(&log(folder.path())));
        let mut other = log(folder.path());
        other.runs[0].0 = "new".into();
        keys.insert(key(&other));
        let option = super::super::options::Argument {
            text: "--voxel=0.2".into(),
            setting: "--voxel=0.2".into(),
            file: None,
        };
        other.options.push(option);
        keys.insert(key(&other));
        assert_eq!(keys.len(), 5);
    }

    #[test]
    fn files_of_a_folder_belong_to_it() {
        let folder = tempfile::tempdir().unwrap();
        // Beside a folder of scans may lie their times, and beside a temporary one anybody's.
        let drive = folder.path().join("drive");
        fs::create_dir_all(drive.join("scans")).unwrap();
        for name in ["scans/0.bin", "scans/1.bin", "times.txt", "report.html"] {
            fs::write(drive.join(name), name).unwrap();
        }
        let roles: Vec<String> = read_with(&drive).into_iter().map(|(role, _)| role).collect();
        assert_eq!(roles, ["scans/0.bin", "scans/1.bin", "times.txt"]);
    }
}
