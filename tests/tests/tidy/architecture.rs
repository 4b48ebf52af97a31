//! `docs/architecture.md` says what is so: what each crate uses, where code is unsafe, where things are.

use std::collections::{BTreeMap, BTreeSet};

use crate::sources::{code_lines, crate_folders, name_of, workspace};

fn page() -> String {
    std::fs::read_to_string(workspace().join("docs/architecture.md")).unwrap()
}

/// What stands between backticks in a text.
fn quoted(text: &str) -> impl Iterator<Item = &str> {
    text.split('`').skip(1).step_by(2)
}

/// The lines of a page from the one that begins like this to its paragraph's end.
fn paragraph<'a>(page: &'a str, beginning: &str) -> &'a str {
    let start = page.find(&format!("\n{beginning}")).unwrap() + 1;
    let text = &page[start..];
    &text[..text.find("\n\n").unwrap_or(text.len())]
}

/// The dependencies of a manifest, on every platform; not those of tests.
fn dependencies(manifest: &toml::Table) -> BTreeSet<String> {
    let targets = manifest.get("target").and_then(toml::Value::as_table).into_iter().flatten();
    let tables = targets.map(|(_, target)| target.get("dependencies"));
    let tables = tables.chain([manifest.get("dependencies")]).flatten();
    tables.flat_map(|table| table.as_table().unwrap().keys().cloned()).collect()
}

#[test]
fn the_table_of_crates_is_that_of_the_manifests() {
    let page = page();
    let helpers: BTreeSet<String> = quoted(paragraph(&page, "Helpers")).map(str::to_owned).collect();
    let rows: BTreeMap<&str, BTreeSet<String>> = paragraph(&page, "| crate |")
        .lines()
        .skip(2)
        .map(|row| {
            let cells: Vec<&str> = row.trim_matches('|').split('|').map(str::trim).collect();
            (
                cells[0].trim_matches('`'),
                cells[2].split(", ").filter(|name| !name.is_empty()).map(str::to_owned).collect(),
            )
        })
        .collect();
    let folders = crate_folders();
    let crates: Vec<String> = folders.iter().map(|folder| name_of(folder)).collect();
    assert_eq!(crates, rows.keys().copied().collect::<Vec<_>>(), "every crate has a row in the table");
    let mut helping = BTreeSet::new();
    for (folder, (name, row)) in folders.iter().zip(&rows) {
        let manifest = std::fs::read_to_string(folder.join("Cargo.toml")).unwrap();
        let used = dependencies(&manifest.parse().unwrap());
        assert_eq!(*row, &used - &helpers, "what {name} uses, in docs/architecture.md and in its manifest");
        helping.extend(&used & &helpers);
    }
    assert_eq!(helpers, helping, "each helper of docs/architecture.md is used");
}

#[test]
fn unsafe_code_is_where_the_invariants_say() {
    let page = page();
    let invariants = paragraph(&page, "1. World coordinates");
    let invariant = invariants.lines().skip_while(|line| !line.contains("`unsafe`"));
    let invariant = invariant.collect::<Vec<_>>().join(" ");
    let listed: BTreeSet<&str> = quoted(&invariant).filter(|name| name.contains(".rs")).collect();
    let lines = code_lines();
    let is_unsafe = |line: &str| ["{", "fn", "impl"].iter().any(|of| line.contains(&format!("unsafe {of}")));
    let found = lines
        .iter()
        .filter(|(_, _, line)| is_unsafe(line))
        .map(|(_, file, _)| file.strip_prefix(workspace().join("crates")).unwrap().to_str().unwrap());
    assert_eq!(listed, found.collect(), "files with unsafe code, in docs/architecture.md and in the crates");
}

#[test]
fn pages_name_files_that_exist() {
    let folder = std::fs::read_dir(workspace().join("docs")).unwrap().map(|entry| entry.unwrap().path());
    let pages = folder.chain(["README.md", "CONTRIBUTING.md"].map(|page| workspace().join(page)));
    let mut missing = Vec::new();
    for page in pages.filter(|page| page.extension().is_some_and(|e| e == "md")) {
        let text = std::fs::read_to_string(&page).unwrap();
        for name in quoted(&text).filter(|name| name.contains("/src/") && !name.contains(char::is_whitespace))
        {
            if ![workspace().join("crates"), workspace()].iter().any(|root| root.join(name).exists()) {
                missing.push(format!("{}: {name}", page.display()));
            }
        }
    }
    assert!(missing.is_empty(), "no such files:\n{}", missing.join("\n"));
}
