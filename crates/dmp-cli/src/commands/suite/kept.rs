//! The folder of results: one file for each log, named by what the result depends on.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use dmp::Report;
use dmp_disk::{ContentHash, ContentMemo, FileState};
use serde::{Deserialize, Serialize};

use super::cache_key;
use super::plan::PlannedLog;
use crate::console::{Common, one_line, say};
use crate::files::{OutputsFolder, is_missing, read_result, save_text};

/// What is known of files and results; nothing is lost without it but time.
const INDEX: &str = "index.json";
const SCHEMA: &str = "dmp-suite-index/1";
/// What lies in the place of a result that another program could not make.
const FAILED: &str = "dmp-suite-problem/1";

/// The folder.
#[derive(Debug)]
pub(super) struct Kept {
    /// As it was named.
    folder: PathBuf,
    memo: ContentMemo,
    /// What each result held when it was kept.
    results: BTreeMap<String, ContentHash>,
}

/// What there is of a result.
#[derive(Debug)]
pub(super) enum Found {
    Whole(Box<Report>),
    Missing,
    /// There is a file, but it is no such result.
    Damaged(String),
    /// Another program tried, and this is why there is none.
    Failed(String),
}

#[derive(Debug, Deserialize)]
struct Failed {
    schema: String,
    problem: String,
}

#[derive(Debug, Serialize, Deserialize)]
struct Index {
    schema: String,
    files: Vec<FileEntry>,
    results: BTreeMap<String, String>,
}

#[derive(Debug, Serialize, Deserialize)]
struct FileEntry {
    path: String,
    bytes: u64,
    modified_ns: i64,
    changed_ns: i64,
    inode: u64,
    hash: String,
}

impl Kept {
    /// Opens the folder, and makes it if need be.
    pub(super) fn open(folder: &Path, common: &Common) -> anyhow::Result<Self> {
        let folder = folder.to_path_buf();
        let _made = OutputsFolder::make(&folder)?;
        let ignored = folder.join(".gitignore");
        if is_missing(&ignored) {
            save_text(&ignored, "*\n")?;
        }
        let mut kept = Self { folder, memo: ContentMemo::new(), results: BTreeMap::new() };
        let path = kept.folder.join(INDEX);
        if let Ok(text) = fs::read_to_string(&path) {
            match serde_json::from_str::<Index>(&text) {
                Ok(index) if index.schema == SCHEMA => kept.take(index),
                _ => say!(common.host, "note: {}: no index, so all files are read once more", path.display()),
            }
        }
        Ok(kept)
    }

    fn take(&mut self, index: Index) {
        for file in index.files {
            let FileEntry { path, bytes, modified_ns, changed_ns, inode, hash } = file;
            if let Ok(hash) = hash.parse() {
                self.memo.remember(path.into(), FileState { bytes, modified_ns, changed_ns, inode }, hash);
            }
        }
        let results = index.results.into_iter().filter_map(|(key, hash)| Some((key, hash.parse().ok()?)));
        self.results.extend(results);
    }

    /// Where the result of a log belongs.
    pub(super) fn file_of(&mut self, log: &PlannedLog, common: &Common) -> anyhow::Result<PathBuf> {
        let key = cache_key::key(log, &mut self.memo, common)?;
        Ok(self.folder.join(format!("{key}.json")))
    }

    /// What is there of it. A result of another program is taken when it is one of these runs.
    pub(super) fn find(&mut self, file: &Path, log: &PlannedLog) -> Found {
        let Ok(bytes) = fs::read(file) else {
            return if is_missing(file) {
                Found::Missing
            } else {
                Found::Damaged("it cannot be read".into())
            };
        };
        if let Ok(failed) = serde_json::from_slice::<Failed>(&bytes)
            && failed.schema == FAILED
        {
            return Found::Failed(failed.problem);
        }
        let (key, hash) = (key_of(file), ContentHash::of(&bytes));
        if self.results.get(&key).is_some_and(|known| *known != hash) {
            return Found::Damaged("it is not as it was written".into());
        }
        let report = match read_result(file) {
            Ok(report) => report,
            Err(error) => {
                let line = one_line(&error);
                let why = line.strip_prefix(&format!("{}: ", file.display())).unwrap_or(&line);
                return Found::Damaged(why.to_owned());
            }
        };
        let excluded = report.left_out.iter().map(|run| &run.name);
        let mut there: Vec<&String> = report.runs.iter().map(|run| &run.name).chain(excluded).collect();
        let mut asked: Vec<&String> = log.runs.iter().map(|(version, _)| version).collect();
        there.sort();
        asked.sort();
        if there != asked {
            return Found::Damaged("it is of other runs".into());
        }
        self.results.insert(key, hash);
        Found::Whole(Box::new(report))
    }

    /// Keeps a result.
    pub(super) fn keep(&mut self, file: &Path, text: &str) -> anyhow::Result<()> {
        save_text(file, text)?;
        self.results.insert(key_of(file), ContentHash::of(text.as_bytes()));
        self.save_index()
    }

    /// Removes a result that is damaged.
    pub(super) fn discard(&mut self, file: &Path) -> anyhow::Result<()> {
        fs::remove_file(file)
            .with_context(|| format!("{}: cannot remove what is damaged", file.display()))?;
        self.results.remove(&key_of(file));
        Ok(())
    }

    /// Keeps what is known of files.
    pub(super) fn save_index(&self) -> anyhow::Result<()> {
        let entry = |(path, state, hash): (&Path, FileState, ContentHash)| {
            let FileState { bytes, modified_ns, changed_ns, inode } = state;
            let path = path.to_str()?.to_owned();
            Some(FileEntry { path, bytes, modified_ns, changed_ns, inode, hash: hash.to_string() })
        };
        let results = self.results.iter().map(|(key, hash)| (key.clone(), hash.to_string()));
        let index = Index {
            schema: SCHEMA.to_owned(),
            files: self.memo.known().filter_map(entry).collect(),
            results: results.collect(),
        };
        save_text(&self.folder.join(INDEX), &serde_json::to_string(&index)?)
    }

    pub(super) fn folder(&self) -> &Path {
        &self.folder
    }
}

fn key_of(file: &Path) -> String {
    file.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}
