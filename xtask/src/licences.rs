//! The licences of everything that the command and the Python package are built of.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context as _, bail};
use clap::Args;
use serde::Deserialize;

use crate::workspace::root;

/// What is handed on: the package whose dependencies are meant, what it is, and the file in the workspace.
const HANDED_ON: [(&str, &str, &str); 2] = [
    ("dmp-cli", "the command `dmp`", "THIRD-PARTY.txt"),
    ("dmp-python", "the Python package `dmp-slam`", "python/THIRD-PARTY.txt"),
];
/// What is linked differs little from system to system; this is what is shipped.
const TARGET: &str = "x86_64-unknown-linux-gnu";
/// Files of a package that say under which terms it comes begin so.
const NAMES: [&str; 5] = ["licen", "copying", "notice", "unlicense", "copyright"];
/// C libraries that packages build and link, with terms of their own: `SQLite`, in `libsqlite3-sys`, is in the public domain.
const INSIDE: [(&str, &str); 2] = [("lz4-sys", "liblz4/lib/LICENSE"), ("zstd-sys", "zstd/LICENSE")];

/// Write the licences of everything that the command is built of into THIRD-PARTY.txt, and those of the Python package
///
/// A text that several packages have stands there once. The file belongs beside the binary wherever that is handed on; the
/// package's is in its wheel.
#[derive(Debug, Args)]
pub(crate) struct LicencesArgs {
    /// Only compare with the file that is there
    #[arg(long)]
    check: bool,
}

/// What `cargo metadata` prints, as far as it is needed.
#[derive(Debug, Deserialize)]
struct Metadata {
    packages: Vec<Package>,
    resolve: Resolve,
}

#[derive(Debug, Deserialize)]
struct Package {
    id: String,
    name: String,
    version: String,
    license: Option<String>,
    #[serde(default)]
    authors: Vec<String>,
    repository: Option<String>,
    /// Null for those of the workspace.
    source: Option<String>,
    manifest_path: PathBuf,
}

#[derive(Debug, Deserialize)]
struct Resolve {
    nodes: Vec<Node>,
}

#[derive(Debug, Deserialize)]
struct Node {
    id: String,
    deps: Vec<Dependency>,
}

#[derive(Debug, Deserialize)]
struct Dependency {
    pkg: String,
    dep_kinds: Vec<Kind>,
}

#[derive(Debug, Deserialize)]
struct Kind {
    /// Null for those that are linked; else `dev` or `build`.
    kind: Option<String>,
}

pub(crate) fn run(arguments: &LicencesArgs) -> anyhow::Result<()> {
    let metadata = metadata()?;
    for (package, what, file) in HANDED_ON {
        let written = listing(what, &linked(&metadata, package)?)?;
        let path = root().join(file);
        if !arguments.check {
            fs::write(&path, written).with_context(|| path.display().to_string())?;
            continue;
        }
        let there = fs::read_to_string(&path).with_context(|| path.display().to_string())?;
        if there != written {
            bail!("{file} is not what `cargo xtask licences` writes");
        }
    }
    Ok(())
}

fn metadata() -> anyhow::Result<Metadata> {
    let arguments = ["metadata", "--format-version=1", "--locked", "--filter-platform", TARGET];
    let output = Command::new(env!("CARGO")).args(arguments).current_dir(root()).output()?;
    if !output.status.success() {
        bail!("cargo metadata: {}", String::from_utf8_lossy(&output.stderr).trim());
    }
    Ok(serde_json::from_slice(&output.stdout)?)
}

/// The packages that are linked into one of the workspace, but for those of the workspace.
fn linked<'a>(metadata: &'a Metadata, into: &str) -> anyhow::Result<Vec<&'a Package>> {
    let nodes: BTreeMap<&str, &Node> =
        metadata.resolve.nodes.iter().map(|node| (node.id.as_str(), node)).collect();
    let root = metadata.packages.iter().find(|package| package.name == into);
    let mut left = vec![root.with_context(|| format!("no package {into}"))?.id.as_str()];
    let mut found = BTreeSet::new();
    while let Some(id) = left.pop() {
        if found.insert(id.to_owned()) {
            let node = nodes.get(id).with_context(|| format!("no node {id}"))?;
            let is_linked =
                |dependency: &&Dependency| dependency.dep_kinds.iter().any(|kind| kind.kind.is_none());
            left.extend(node.deps.iter().filter(is_linked).map(|dependency| dependency.pkg.as_str()));
        }
    }
    let is_foreign = |package: &&Package| package.source.is_some() && found.contains(&package.id);
    let mut packages: Vec<&Package> = metadata.packages.iter().filter(is_foreign).collect();
    packages.sort_by(|a, b| (&a.name, &a.version).cmp(&(&b.name, &b.version)));
    Ok(packages)
}

fn listing(what: &str, packages: &[&Package]) -> anyhow::Result<String> {
    // Each text, with who has it.
    let mut texts: BTreeMap<String, Vec<String>> = BTreeMap::new();
    let mut written = format!(
        "What {what} is built of, and under which terms. Made by `cargo xtask licences`.\n\n\
         The standard library of Rust: MIT OR Apache-2.0; https://github.com/rust-lang/rust\n"
    );
    for package in packages {
        let name = format!("{} {}", package.name, package.version);
        let Some(license) = &package.license else { bail!("{name} does not name its licence") };
        let from = package.repository.as_deref().unwrap_or("-");
        let _ = writeln!(written, "{name}: {license}; {from}");
        let own = texts_of(package)?;
        if own.is_empty() {
            let authors = package.authors.join(", ");
            let text = format!("No text comes with it. Its manifest: {license}; {authors}");
            texts.entry(text).or_default().push(name.clone());
        }
        for text in own {
            texts.entry(text).or_default().push(name.clone());
        }
    }
    let mut texts: Vec<(String, Vec<String>)> = texts.into_iter().collect();
    texts.sort_by(|(_, a), (_, b)| a.cmp(b));
    for (text, names) in texts {
        let _ = write!(written, "\n{}\n{}\n\n{text}\n", "=".repeat(80), names.join(", "));
    }
    Ok(written)
}

/// The texts that come with a package, in the order of their files' names.
fn texts_of(package: &Package) -> anyhow::Result<Vec<String>> {
    let folder = package.manifest_path.parent().unwrap_or(Path::new("."));
    let mut files: Vec<PathBuf> = Vec::new();
    for entry in fs::read_dir(folder).with_context(|| folder.display().to_string())? {
        let path = entry?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
        if path.is_file() && NAMES.iter().any(|start| name.starts_with(start)) {
            files.push(path);
        }
    }
    files.sort();
    files.extend(INSIDE.iter().filter(|(name, _)| *name == package.name).map(|(_, file)| folder.join(file)));
    let text = |path: &PathBuf| {
        let bytes = fs::read(path).with_context(|| path.display().to_string())?;
        let text = String::from_utf8_lossy(&bytes);
        // Where they only differ in white space at the ends of lines they are one.
        Ok(text.lines().map(str::trim_end).collect::<Vec<_>>().join("\n").trim_matches('\n').to_owned())
    };
    files.iter().map(text).collect()
}
