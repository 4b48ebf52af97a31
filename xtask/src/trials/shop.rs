//! Makes the files of seeds, by the command itself, in a folder of its own.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context as _, ensure};

use super::seed::{File, Form};

/// Where seeds are made.
#[derive(Debug)]
pub(crate) struct Shop<'a> {
    dmp: &'a Path,
    folder: tempfile::TempDir,
    others: PathBuf,
}

impl<'a> Shop<'a> {
    pub(crate) fn open(dmp: &'a Path) -> anyhow::Result<Self> {
        let others = crate::workspace::root().join("tests/conformance");
        Ok(Self { dmp, folder: tempfile::tempdir()?, others })
    }

    /// Runs a command; what it prints.
    pub(crate) fn make(&self, line: &str) -> anyhow::Result<Vec<u8>> {
        let mut command = Command::new(self.dmp);
        command.args(line.split_whitespace()).current_dir(self.folder.path()).stdin(Stdio::null());
        let output = command.output()?;
        let said = String::from_utf8_lossy(&output.stderr);
        ensure!(output.status.success(), "making seeds: dmp {line}: {}: {said}", output.status);
        Ok(output.stdout)
    }

    /// A file that was made.
    pub(crate) fn made(&self, path: &str, form: impl Into<Option<Form>>) -> anyhow::Result<File> {
        read(self.folder.path(), path, path, form.into())
    }

    /// A file that other software wrote, below `tests/conformance`, under another name.
    pub(crate) fn of_others(
        &self,
        path: &str,
        name: &str,
        form: impl Into<Option<Form>>,
    ) -> anyhow::Result<File> {
        read(&self.others, path, name, form.into())
    }

    /// Names of the files of other software in a folder that end in `end`, sorted.
    pub(crate) fn names_of_others(&self, folder: &str, end: &str) -> anyhow::Result<Vec<String>> {
        names(&self.others.join(folder), end)
    }

    /// All files of a folder that was made, and of those in it. The first two with each ending have a form to be
    /// damaged by: one scan is like the next.
    pub(crate) fn made_folder(
        &self,
        folder: &str,
        form: fn(&str) -> Option<Form>,
    ) -> anyhow::Result<Vec<File>> {
        let mut files = Vec::new();
        let mut open = vec![folder.to_owned()];
        while let Some(at) = open.pop() {
            let mut attacked = 0;
            for name in names(&self.folder.path().join(&at), "")? {
                let path = format!("{at}/{name}");
                if self.folder.path().join(&path).is_dir() {
                    open.push(path);
                    continue;
                }
                let form = form(&name).filter(|form| attacked < 2 || *form == Form::Text);
                attacked += usize::from(form.is_some());
                files.push(self.made(&path, form)?);
            }
        }
        Ok(files)
    }
}

fn read(folder: &Path, path: &str, name: &str, form: Option<Form>) -> anyhow::Result<File> {
    let bytes = std::fs::read(folder.join(path)).with_context(|| format!("a seed's {path}"))?;
    Ok(File { path: name.to_owned(), bytes, form })
}

fn names(folder: &Path, end: &str) -> anyhow::Result<Vec<String>> {
    let entries = std::fs::read_dir(folder).with_context(|| format!("{}", folder.display()))?;
    let mut names = Vec::new();
    for entry in entries {
        let name = entry?.file_name().to_string_lossy().into_owned();
        if name.ends_with(end) {
            names.push(name);
        }
    }
    names.sort();
    Ok(names)
}
