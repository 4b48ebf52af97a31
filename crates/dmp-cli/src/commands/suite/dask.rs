//! Scoring on a cluster of Dask, which the Python package does.

use std::env;
use std::ffi::OsString;
use std::fs::File;
use std::io::{BufRead as _, BufReader, Read as _, Seek as _, SeekFrom, Write as _};
use std::os::unix::process::CommandExt as _;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::thread;
use std::time::Duration;

use anyhow::{Context as _, bail};
use serde::{Deserialize, Serialize};

use super::list::List;
use crate::console::{Common, Progress, Usage, say};
use crate::options::{Asked, scoring};

/// Names the Python that has the package; the command that comes with the package sets it.
const PYTHON: &str = "DMP_PYTHON";
/// The module that is run.
const MODULE: &str = "dmp_slam._shards.suite";
/// How often it is looked whether somebody asked to stop.
const LOOK: Duration = Duration::from_millis(100);
/// What is read of what a program said before it failed, bytes.
const MOST_SAID: u64 = 1 << 16;

/// What is asked of the program. It stops when its standard input ends.
#[derive(Debug, Serialize)]
struct Order<'a> {
    address: &'a str,
    list: &'a List,
    /// Options of each task.
    means: Vec<String>,
    work: Option<String>,
}

/// A line of what the program answers.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Answer {
    Say(String),
    /// So many logs are done.
    Done(u64),
    Failed {
        line: String,
        is_usage: bool,
    },
}

/// Scores logs on a cluster, into the files of their results; where one cannot be scored, its file says why.
pub(super) fn score(address: &str, list: &List, asked: &Asked, common: &Common) -> anyhow::Result<()> {
    if list.logs.is_empty() {
        return Ok(());
    }
    let python = env::var_os(PYTHON).unwrap_or_else(|| "python3".into());
    let said = tempfile::tempfile().context("cannot make a file for what Python says")?;
    let mut child = started(&python, &said)?;
    let work = asked.get(&scoring::WORK).map(|folder| folder.display().to_string());
    let means = [asked.as_arguments(&scoring::MEMORY), asked.as_arguments(&scoring::THREADS)].concat();
    let order = Order { address, list, means, work };
    // It is open for as long as the work is wanted. Where nobody reads it, the program has failed, and that is reported below.
    let mut input = child.stdin.take();
    if let Some(input) = &mut input {
        let _ = input.write_all(&serde_json::to_vec(&order)?).and_then(|()| input.write_all(b"\n"));
    }
    let lines = lines_of(&mut child);
    let watched = watch(&lines, address, list, common);
    drop(input);
    let status = child.wait().context("cannot wait for Python")?;
    match watched? {
        None if status.success() => Ok(()),
        None => bail!(Usage(format!(
            "--dask needs the Python package, pip install 'dmp-slam[dask]' ({PYTHON} names a Python that has it): {}: {}",
            python.display(),
            last_line(said).unwrap_or_else(|| status.to_string())
        ))),
        Some((line, true)) => bail!(Usage(line)),
        Some((line, false)) => bail!(line),
    }
}

/// The program; it is not stopped by what stops this one, but when its input ends.
fn started(python: &OsString, said: &File) -> anyhow::Result<Child> {
    let mut command = Command::new(python);
    command.args(["-m", MODULE]).process_group(0);
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(said.try_clone()?);
    command.spawn().map_err(|error| {
        let python = python.display();
        Usage(format!("--dask needs Python, and {python} cannot be run ({PYTHON} names another): {error}"))
            .into()
    })
}

/// The lines that a program prints, as they come.
fn lines_of(child: &mut Child) -> Receiver<String> {
    let (sent, lines) = mpsc::channel();
    if let Some(printed) = child.stdout.take() {
        thread::spawn(move || {
            let lines = BufReader::new(printed).lines();
            lines.map_while(Result::ok).try_for_each(|line| sent.send(line))
        });
    }
    lines
}

/// Prints what the program does, until it ends; what it failed with, and whether it was used wrongly.
fn watch(
    lines: &Receiver<String>,
    address: &str,
    list: &List,
    common: &Common,
) -> anyhow::Result<Option<(String, bool)>> {
    let mut failed = None;
    let progress = Progress::new(common);
    progress.start("scoring logs", "logs", list.logs.len() as u64);
    let mut known = 0;
    loop {
        match lines.recv_timeout(LOOK) {
            Ok(line) => match serde_json::from_str(&line) {
                Ok(Answer::Say(line)) if !common.quiet => progress.suspend(|| say!(common.host, "{line}")),
                Ok(Answer::Done(done)) => {
                    progress.done(done.saturating_sub(known));
                    known = done;
                }
                Ok(Answer::Failed { line, is_usage }) => {
                    failed = Some((format!("--dask {address}: {line}"), is_usage));
                }
                // The command is quiet, or a library prints.
                Ok(Answer::Say(_)) | Err(_) => {}
            },
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return Ok(failed),
        }
        common.host.go_on()?;
    }
}

/// The last line of what a program said.
fn last_line(mut said: File) -> Option<String> {
    let end = said.seek(SeekFrom::End(0)).ok()?;
    said.seek(SeekFrom::Start(end.saturating_sub(MOST_SAID))).ok()?;
    let mut bytes = Vec::new();
    said.read_to_end(&mut bytes).ok()?;
    let text = String::from_utf8_lossy(&bytes);
    text.lines().rev().find(|line| !line.trim().is_empty()).map(str::to_owned)
}
