//! The plan of a suite: every log with its runs and arguments.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::bail;
use dmp::Confidence;
use dmp_suite::{Failures, MissingReport};
use toml::Value;

use super::file::{At, LogEntry, SuiteFile};
use super::options::{self, Argument, Options};
use super::paths::{Source, resolve};
use crate::console::Usage;

/// All logs, and how sure the verdicts are to be.
#[derive(Debug)]
pub(super) struct Plan {
    /// The folder of the suite, from the root.
    pub(super) folder: PathBuf,
    pub(super) logs: Vec<PlannedLog>,
    /// A log with fewer runs is not scored.
    pub(super) least_runs: usize,
    pub(super) confidence: Confidence,
}

/// A log with its runs.
#[derive(Debug)]
pub(super) struct PlannedLog {
    pub(super) name: String,
    /// From the root.
    pub(super) path: PathBuf,
    /// Versions with a run, each with its trajectory as the command takes it.
    pub(super) runs: Vec<(String, String)>,
    pub(super) missing: Vec<MissingReport>,
    pub(super) options: Vec<Argument>,
}

impl Plan {
    pub(super) fn make(file: &SuiteFile, failures: Failures) -> anyhow::Result<Self> {
        let mut logs: Vec<PlannedLog> = Vec::new();
        for entry in &file.logs {
            for (path, name) in paths(file, entry)? {
                let at = At::new(&file.path, &format!("{}.name", entry.key));
                let is_name = !name.is_empty() && name.chars().all(dmp::is_printable);
                if logs.iter().any(|log| log.name == name) || !is_name {
                    let why = if is_name { "another log has this name: set `name`" } else { "it is no name" };
                    bail!(at.wrong(&Value::String(name), why));
                }
                logs.push(PlannedLog::plan(file, entry, path, name)?);
            }
        }
        let at = At::new(&file.path, "versions");
        for version in &file.versions {
            let has_run = |log: &PlannedLog| log.runs.iter().any(|(name, _)| name == version);
            if !logs.iter().any(has_run) {
                let missing = logs.iter().flat_map(|log| &log.missing).find(|run| run.version == *version);
                let why = missing.map_or(String::new(), |run| format!(": {}", run.reason));
                bail!(at.unknown(&format!("`{version}` has no run on any log{why}")));
            }
        }
        let mut confidence = None;
        let least_runs = if failures == Failures::Worse { 1 } else { 2 };
        for log in logs.iter().filter(|log| log.runs.len() >= least_runs) {
            let wrong = |why| Usage(format!("{}: log `{}`: {why}", file.path.display(), log.name));
            confidence = Some(options::parsed(&log.arguments()).map_err(wrong)?.config().confidence);
        }
        let confidence = confidence.ok_or_else(|| at.unknown("no log has runs of two of them"))?;
        Ok(Self { folder: file.folder.clone(), logs, least_runs, confidence })
    }

    /// Every file that is read, as far as it is named.
    pub(super) fn inputs(&self) -> Vec<PathBuf> {
        let of_log = |log: &PlannedLog| {
            let runs = log.runs.iter().filter_map(|(_, run)| Source::of(run).and_then(Source::file));
            let options = log.options.iter().filter_map(|option| option.file.clone());
            std::iter::once(log.path.clone()).chain(runs).chain(options).collect::<Vec<_>>()
        };
        self.logs.iter().flat_map(of_log).collect()
    }
}

impl PlannedLog {
    fn plan(file: &SuiteFile, entry: &LogEntry, path: PathBuf, name: String) -> anyhow::Result<Self> {
        let at = At::new(&file.path, &entry.key);
        let (mut runs, mut missing) = (Vec::new(), Vec::new());
        for version in &file.versions {
            let pattern = entry.trajectories.of(version).or_else(|| file.trajectories.of(version));
            let reason = match pattern {
                None => "the suite has no trajectory for it".to_owned(),
                Some(pattern) => {
                    let named = pattern.replace("{version}", version).replace("{log}", &name);
                    if let Some(place) = named.split('{').nth(1).and_then(|rest| rest.split('}').next()) {
                        let why = format!("{{{place}}} is neither {{version}} nor {{log}}");
                        bail!(
                            At::new(&file.path, "trajectories").wrong(&Value::String(pattern.into()), &why)
                        );
                    }
                    let run = resolve(&file.folder, &named);
                    if Source::of(&run).is_some() {
                        runs.push((version.clone(), run));
                        continue;
                    }
                    format!("no such file: {named}")
                }
            };
            missing.push(MissingReport { version: version.clone(), reason });
        }
        let present: Vec<&str> = runs.iter().map(|(version, _)| version.as_str()).collect();
        let options =
            Options { versions: &file.versions, present: &present, folder: &file.folder, log: &name };
        if let Some(value) = entry.options.get("confidence") {
            bail!(at.below("confidence").wrong(value, "it is the same for all logs: set it in [score]"));
        }
        let mut table = file.score.clone();
        let of_log = options.arguments(&at, &entry.options)?;
        let is_same = |a: &str, b: &str| a.replace('_', "-") == b.replace('_', "-");
        table.retain(|key, _| !entry.options.keys().any(|own| is_same(own, key)));
        let mut options = options.arguments(&At::new(&file.path, "score"), &table)?;
        options.extend(of_log);
        options.sort_by(|a, b| a.text.split('=').next().cmp(&b.text.split('=').next()));
        Ok(Self { name, path, runs, missing, options })
    }

    /// The arguments of `dmp score`, behind that word.
    pub(super) fn arguments(&self) -> Vec<String> {
        let runs = self.runs.iter().map(|(version, run)| format!("--trajectory={version}={run}"));
        let options = self.options.iter().map(|option| option.text.clone());
        let end = ["--json".to_owned(), "--".to_owned(), self.path.display().to_string()];
        runs.chain(options).chain(end).collect()
    }
}

/// The logs that an entry stands for, with their names: a `*` in the last part of its path stands for anything.
fn paths(file: &SuiteFile, entry: &LogEntry) -> anyhow::Result<Vec<(PathBuf, String)>> {
    let at = At::new(&file.path, &format!("{}.path", entry.key));
    let value = Value::String(entry.path.clone());
    let path = PathBuf::from(resolve(&file.folder, &entry.path));
    let pattern = path.file_name().and_then(|name| name.to_str()).and_then(|name| name.split_once('*'));
    let (Some((start, end)), Some(folder)) = (pattern, path.parent()) else {
        if !path.exists() {
            bail!(at.wrong(&value, "no such file or folder"));
        }
        let name = entry.name.clone().unwrap_or_else(|| name_of(&path));
        return Ok(vec![(path, name)]);
    };
    if let Some(name) = &entry.name {
        bail!(
            At::new(&file.path, &format!("{}.name", entry.key))
                .wrong(&Value::String(name.clone()), "several logs would have this name")
        );
    }
    let is_one = |path: &PathBuf| {
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        let fits = |name: &str| name.strip_prefix(start).is_some_and(|rest| rest.ends_with(end));
        !name.starts_with('.') && name.len() >= start.len() + end.len() && fits(name)
    };
    let entries = fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let mut found: Vec<PathBuf> = entries.filter(is_one).collect();
    found.sort();
    if found.is_empty() {
        bail!(at.wrong(&value, "no file or folder has such a name"));
    }
    Ok(found.into_iter().map(|path| (path.clone(), name_of(&path))).collect())
}

/// What a log is called by its path.
fn name_of(path: &Path) -> String {
    let stem = if path.is_dir() { path.file_name() } else { path.file_stem() };
    stem.map_or(String::new(), |stem| stem.to_string_lossy().into_owned())
}
