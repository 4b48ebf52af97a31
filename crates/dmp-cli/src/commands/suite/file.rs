//! The file of a suite.

use std::collections::BTreeMap;
use std::io::Read as _;
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use dmp_disk::{folder_of, open_input};
use dmp_log::{LogError, is_printable};
use toml::{Table, Value};

use crate::console::{Unreadable, Usage};
use crate::files::is_missing;

/// What a suite looks like.
pub(super) const EXAMPLE: &str = include_str!("example.toml");
/// A suite longer than this is none.
const MAX_BYTES: u64 = 16 << 20;

/// A suite as it was written.
#[derive(Debug)]
pub(super) struct SuiteFile {
    /// The file, as it was named.
    pub(super) path: PathBuf,
    /// Its folder, from the root: paths count from there.
    pub(super) folder: PathBuf,
    pub(super) versions: Vec<String>,
    pub(super) trajectories: Patterns,
    /// Options of `dmp score` for all logs.
    pub(super) score: Table,
    pub(super) logs: Vec<LogEntry>,
    pub(super) gates: Table,
}

/// A log as it was written.
#[derive(Debug)]
pub(super) struct LogEntry {
    /// Where it stands, as `logs[2]`.
    pub(super) key: String,
    pub(super) path: String,
    pub(super) name: Option<String>,
    pub(super) trajectories: Patterns,
    /// Options of `dmp score` for this log.
    pub(super) options: Table,
}

/// Where trajectories are, with `{version}` and `{log}` in place of names.
#[derive(Debug, Default)]
pub(super) struct Patterns {
    all: Option<String>,
    by_version: BTreeMap<String, String>,
}

impl Patterns {
    /// That of a version.
    pub(super) fn of(&self, version: &str) -> Option<&str> {
        self.by_version.get(version).or(self.all.as_ref()).map(String::as_str)
    }

    fn read(at: &At<'_>, value: Option<Value>, versions: &[String]) -> Result<Self, Usage> {
        match value {
            None => Ok(Self::default()),
            Some(Value::String(all)) => Ok(Self { all: Some(all), by_version: BTreeMap::new() }),
            Some(Value::Table(table)) => {
                let pattern = |(version, value): (String, Value)| {
                    let at = at.below(&version);
                    if !versions.contains(&version) {
                        return Err(at.wrong(&value, &format!("the versions are {}", versions.join(", "))));
                    }
                    let pattern = text(&at, value)?;
                    Ok((version, pattern))
                };
                let by_version = table.into_iter().map(pattern).collect::<Result<_, _>>()?;
                Ok(Self { all: None, by_version })
            }
            Some(other) => Err(at.wrong(&other, "a path, or a path for each version, is expected")),
        }
    }
}

/// A key of the file, to say what is wrong with its value.
#[derive(Debug, Clone)]
pub(super) struct At<'a> {
    file: &'a Path,
    key: String,
}

impl<'a> At<'a> {
    pub(super) fn new(file: &'a Path, key: &str) -> Self {
        Self { file, key: key.to_owned() }
    }

    pub(super) fn below(&self, key: &str) -> Self {
        let key = if self.key.is_empty() { key.to_owned() } else { format!("{}.{key}", self.key) };
        Self { file: self.file, key }
    }

    /// What is wrong with a value.
    pub(super) fn wrong(&self, value: &Value, why: &str) -> Usage {
        self.problem(&format!("{} = {value}: {why}", self.key))
    }

    /// What is wrong with the key itself.
    pub(super) fn unknown(&self, why: &str) -> Usage {
        self.problem(&format!("{}: {why}", self.key))
    }

    fn problem(&self, problem: &str) -> Usage {
        Usage(format!("{}: {problem}", self.file.display()))
    }
}

impl SuiteFile {
    pub(super) fn read(path: &Path) -> anyhow::Result<Self> {
        if is_missing(path) {
            return Err(LogError::NotFound { path: path.to_path_buf() }.into());
        }
        let mut text = String::new();
        let file = open_input(path).map_err(|error| Unreadable(error.into()));
        let file = file.with_context(|| path.display().to_string())?;
        let read = file.take(MAX_BYTES).read_to_string(&mut text).map_err(|error| Unreadable(error.into()));
        read.with_context(|| format!("{}: no suite", path.display()))?;
        let table: Table = toml::from_str(&text).map_err(|error| not_toml(path, &text, &error))?;
        let folder = std::path::absolute(folder_of(path))?;
        Ok(Self::of(path, folder, table)?)
    }

    fn of(path: &Path, folder: PathBuf, mut table: Table) -> Result<Self, Usage> {
        let top = At::new(path, "");
        let versions = versions(&top.below("versions"), table.remove("versions"))?;
        let at = top.below("trajectories");
        let trajectories = Patterns::read(&at, table.remove("trajectories"), &versions)?;
        let score = sub_table(&top.below("score"), table.remove("score"))?;
        let gates = sub_table(&top.below("gates"), table.remove("gates"))?;
        let mut logs = Vec::new();
        for key in ["logs", "log"] {
            let at = top.below(key);
            match table.remove(key) {
                None => {}
                Some(Value::Array(entries)) => {
                    for (k, entry) in entries.into_iter().enumerate() {
                        let at = At::new(path, &format!("{key}[{}]", k + 1));
                        logs.push(log_entry(&at, entry, &versions)?);
                    }
                }
                Some(entry @ Value::String(_)) => logs.push(log_entry(&at, entry, &versions)?),
                Some(other) => return Err(at.wrong(&other, "a list of logs is expected")),
            }
        }
        if let Some((key, value)) = table.iter().next() {
            let known = "the keys are versions, trajectories, logs, log, score and gates; options of `dmp score` go into [score]";
            return Err(top.below(key).wrong(value, known));
        }
        if logs.is_empty() {
            return Err(top.below("logs").unknown("no log is named"));
        }
        Ok(Self { path: path.to_path_buf(), folder, versions, trajectories, score, logs, gates })
    }
}

/// Where a file is no TOML, in a line.
fn not_toml(path: &Path, text: &str, error: &toml::de::Error) -> anyhow::Error {
    let start = error.span().map_or(0, |span| span.start.min(text.len()));
    let line = text.get(..start).unwrap_or_default().matches('\n').count() + 1;
    let message = error.message().replace('\n', " ");
    Usage(format!("{}: line {line}: {message}", path.display())).into()
}

fn versions(at: &At<'_>, value: Option<Value>) -> Result<Vec<String>, Usage> {
    let expected = "two names at least are expected, as [\"old\", \"new\"]";
    let value = value.ok_or_else(|| at.unknown(expected))?;
    let names = value.as_array().and_then(|names| {
        names.iter().map(|name| name.as_str().map(str::to_owned)).collect::<Option<Vec<_>>>()
    });
    let names = names.filter(|names| names.len() > 1).ok_or_else(|| at.wrong(&value, expected))?;
    for (k, name) in names.iter().enumerate() {
        let is_name = !name.is_empty() && name.chars().all(|c| is_printable(c) && !"=/\\,:".contains(c));
        if !is_name {
            return Err(at.wrong(&value, &format!("`{name}` is no name: it has = / \\ , : or nothing in it")));
        }
        if names[..k].contains(name) {
            return Err(at.wrong(&value, &format!("`{name}` is named twice")));
        }
    }
    Ok(names)
}

fn sub_table(at: &At<'_>, value: Option<Value>) -> Result<Table, Usage> {
    match value {
        None => Ok(Table::new()),
        Some(Value::Table(table)) => Ok(table),
        Some(other) => Err(at.wrong(&other, "a table is expected")),
    }
}

fn log_entry(at: &At<'_>, value: Value, versions: &[String]) -> Result<LogEntry, Usage> {
    let mut table = match value {
        Value::String(path) => Table::from_iter([("path".to_owned(), Value::String(path))]),
        Value::Table(table) => table,
        other => return Err(at.wrong(&other, "a path, or a table with a path, is expected")),
    };
    let path = table.remove("path").ok_or_else(|| at.unknown("it has no path"))?;
    let name = table.remove("name").map(|name| text(&at.below("name"), name)).transpose()?;
    let trajectories = Patterns::read(&at.below("trajectories"), table.remove("trajectories"), versions)?;
    let path = text(&at.below("path"), path)?;
    Ok(LogEntry { key: at.key.clone(), path, name, trajectories, options: table })
}

fn text(at: &At<'_>, value: Value) -> Result<String, Usage> {
    match value {
        Value::String(text) if !text.is_empty() => Ok(text),
        other => Err(at.wrong(&other, "a text is expected")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(text: &str) -> Result<SuiteFile, String> {
        let table = toml::from_str(text).unwrap();
        SuiteFile::of(Path::new("s.toml"), "/w".into(), table).map_err(|error| error.to_string())
    }

    #[test]
    fn the_example_is_a_suite() {
        let suite = of(EXAMPLE).unwrap();
        assert_eq!(suite.versions, ["old", "new"]);
        assert_eq!(suite.logs.len(), 4);
        assert_eq!(suite.logs[3].name.as_deref(), Some("garage"));
        assert_eq!(suite.logs[3].trajectories.of("new"), Some("elsewhere/garage.tum"));
        assert_eq!(suite.logs[3].trajectories.of("old"), None);
        assert_eq!(suite.logs[3].options.len(), 2);
        assert_eq!(suite.trajectories.of("old"), Some("runs/{version}/{log}.tum"));
    }

    #[test]
    fn errors_name_file_key_and_value() {
        let two = "versions = [\"a\", \"b\"]\n";
        for (text, part) in [
            ("", "s.toml: versions: two names at least are expected"),
            ("versions = [\"a\"]", "s.toml: versions = [\"a\"]: two names at least"),
            ("versions = [\"a\", \"a\"]", "s.toml: versions = [\"a\", \"a\"]: `a` is named twice"),
            ("versions = [\"a\", \"b/c\"]", "`b/c` is no name"),
            (two, "s.toml: logs: no log is named"),
            (&format!("{two}logs = [3]"), "s.toml: logs[1] = 3: a path, or a table with a path, is expected"),
            (&format!("{two}logs = []\nvoxel = 0.2"), "s.toml: voxel = 0.2: the keys are versions, "),
            (&format!("{two}[[log]]\nname = \"x\""), "s.toml: log[1]: it has no path"),
            (
                &format!("{two}trajectories = {{ c = \"x\" }}"),
                "s.toml: trajectories.c = \"x\": the versions are a, b",
            ),
            (&format!("{two}score = 1"), "s.toml: score = 1: a table is expected"),
        ] {
            let error = of(text).unwrap_err();
            assert!(error.contains(part), "{error}");
        }
    }
}
