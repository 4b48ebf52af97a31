//! The files of a plan in its folder: `plan.json`, which a person can read, and its runs.

use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use dmp::Run;
use dmp_disk::{open_input, read_checked, write_checked};
use dmp_log::{LogIndex, ScanLog};
use dmp_shard::{ShardError, ShardPlan};
use serde::Serialize as _;
use serde_json::ser::Formatter;

use crate::files::save;

const PLAN: &str = "plan.json";
const RUNS: &str = "runs.part";

/// A plan, its runs, and the folder that they lie in.
pub(super) struct OpenedPlan {
    pub(super) folder: PathBuf,
    pub(super) plan: ShardPlan,
    pub(super) runs: Vec<Run>,
}

/// An error as the command prints it: those of scoring and of logs name options.
pub(super) fn in_words(error: ShardError) -> anyhow::Error {
    match error {
        ShardError::Evaluate(error) => error.into(),
        ShardError::Log(error) => error.into(),
        error => error.into(),
    }
}

/// Writes a plan and its runs.
pub(super) fn write(folder: &Path, plan: &ShardPlan, runs: &[Run]) -> anyhow::Result<()> {
    write_checked(&folder.join(RUNS), &ShardPlan::runs_bytes(runs).map_err(in_words)?)?;
    save(&folder.join(PLAN), |out| {
        let mut json = serde_json::Serializer::with_formatter(&mut *out, Lines::default());
        plan.serialize(&mut json).map_err(io::Error::from)?;
        writeln!(out)
    })
}

impl OpenedPlan {
    /// Reads a plan, given by its folder or its file.
    pub(super) fn read(path: &Path) -> anyhow::Result<Self> {
        let (folder, file) = if path.is_dir() {
            (path.to_owned(), path.join(PLAN))
        } else {
            (dmp_disk::folder_of(path).to_owned(), path.to_owned())
        };
        let plan = read_plan(&file)?;
        plan.check().map_err(in_words).with_context(|| file.display().to_string())?;
        let path = folder.join(RUNS);
        let bytes = read_checked(&path)?
            .with_context(|| format!("{}: it is not there, and belongs to the plan", path.display()))?;
        let runs = plan.read_runs(&path, &bytes).map_err(in_words)?;
        Ok(Self { folder, plan, runs })
    }

    /// Opens the log of the plan, where it was or where it is now.
    pub(super) fn open_log(&self, now_at: Option<&Path>) -> anyhow::Result<Box<dyn ScanLog>> {
        Ok(self.index().open(now_at.unwrap_or(self.plan.log()))?)
    }

    /// The log for what does not read its scans: without its files, where that can be.
    pub(super) fn unopened_log(&self, now_at: Option<&Path>) -> anyhow::Result<Box<dyn ScanLog>> {
        match self.index().unopened()? {
            Some(log) => Ok(log),
            None => self.open_log(now_at),
        }
    }

    fn index(&self) -> &LogIndex {
        self.plan.index()
    }
}

fn read_plan(file: &Path) -> anyhow::Result<ShardPlan> {
    let input = open_input(file).with_context(|| format!("{}: cannot open the plan", file.display()))?;
    serde_json::from_reader(io::BufReader::new(input))
        .with_context(|| format!("{}: no plan of `dmp shard plan`", file.display()))
}

/// The plan that lies in a folder; `None` where there is none.
pub(super) fn plan_in(folder: &Path) -> anyhow::Result<Option<ShardPlan>> {
    let file = folder.join(PLAN);
    if file.exists() { read_plan(&file).map(Some) } else { Ok(None) }
}

/// A line for each member of an object and for each element of a list, but what is in lists on one line.
#[derive(Debug, Default)]
struct Lines {
    depth: usize,
    lists: usize,
}

impl Lines {
    fn line(&self, out: &mut (impl io::Write + ?Sized)) -> io::Result<()> {
        writeln!(out)?;
        (0..self.depth).try_for_each(|_| out.write_all(b" "))
    }

    fn next(&self, out: &mut (impl io::Write + ?Sized), first: bool, most_lists: usize) -> io::Result<()> {
        if !first {
            out.write_all(b",")?;
        }
        match (self.lists <= most_lists, first) {
            (true, _) => self.line(out),
            (false, true) => Ok(()),
            (false, false) => out.write_all(b" "),
        }
    }
}

impl Formatter for Lines {
    fn begin_array<W: io::Write + ?Sized>(&mut self, out: &mut W) -> io::Result<()> {
        self.depth += 1;
        self.lists += 1;
        out.write_all(b"[")
    }

    fn end_array<W: io::Write + ?Sized>(&mut self, out: &mut W) -> io::Result<()> {
        self.depth -= 1;
        self.lists -= 1;
        out.write_all(b"]")
    }

    fn begin_array_value<W: io::Write + ?Sized>(&mut self, out: &mut W, first: bool) -> io::Result<()> {
        self.next(out, first, 1)
    }

    fn begin_object<W: io::Write + ?Sized>(&mut self, out: &mut W) -> io::Result<()> {
        self.depth += 1;
        out.write_all(b"{")
    }

    fn end_object<W: io::Write + ?Sized>(&mut self, out: &mut W) -> io::Result<()> {
        self.depth -= 1;
        out.write_all(b"}")
    }

    fn begin_object_key<W: io::Write + ?Sized>(&mut self, out: &mut W, first: bool) -> io::Result<()> {
        self.next(out, first, 0)
    }

    fn begin_object_value<W: io::Write + ?Sized>(&mut self, out: &mut W) -> io::Result<()> {
        out.write_all(b": ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scan_is_a_line() {
        let value = serde_json::json!({"a": {"b": [[1, 2.5], [{"c": null}]]}, "d": "x"});
        let mut text = Vec::new();
        value.serialize(&mut serde_json::Serializer::with_formatter(&mut text, Lines::default())).unwrap();
        let text = String::from_utf8(text).unwrap();
        assert_eq!(text, "{\n \"a\": {\n  \"b\": [\n   [1, 2.5],\n   [{\"c\": null}]]},\n \"d\": \"x\"}");
        assert_eq!(serde_json::from_str::<serde_json::Value>(&text).unwrap(), value);
    }
}
