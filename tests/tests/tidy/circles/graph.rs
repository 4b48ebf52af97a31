//! Which files lie on a loop of imports.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// The names that a file (first) takes from another (second).
pub(super) type Imports = BTreeMap<(PathBuf, PathBuf), BTreeSet<String>>;

/// The files that can be reached from a file.
fn reached<'a>(imports: &'a Imports, from: &'a Path) -> BTreeSet<&'a Path> {
    let mut found = BTreeSet::new();
    let mut open = vec![from];
    while let Some(file) = open.pop() {
        let next = imports.keys().filter(|(user, _)| user == file).map(|(_, used)| used.as_path());
        open.extend(next.filter(|used| found.insert(*used)));
    }
    found
}

/// Every largest set of files each of which reaches every other, in words: a line for each import in it.
pub(super) fn circles(imports: &Imports) -> Vec<String> {
    let files: BTreeSet<&Path> = imports.keys().map(|(user, _)| user.as_path()).collect();
    let reach: BTreeMap<&Path, BTreeSet<&Path>> =
        files.iter().map(|file| (*file, reached(imports, file))).collect();
    let mut circles = Vec::new();
    for (file, ahead) in &reach {
        let both = |other: &&&Path| reach.get(**other).is_some_and(|back| back.contains(file));
        let circle: BTreeSet<&Path> = ahead.iter().filter(both).copied().collect();
        // Told once, at the first of its files.
        if circle.first() != Some(file) {
            continue;
        }
        let mut text = format!("{} files", circle.len());
        for ((user, used), names) in imports {
            if circle.contains(user.as_path()) && circle.contains(used.as_path()) {
                let names: Vec<&str> = names.iter().map(String::as_str).collect();
                let _ = write!(text, "\n  {} -> {}: {}", user.display(), used.display(), names.join(", "));
            }
        }
        circles.push(text);
    }
    circles
}
