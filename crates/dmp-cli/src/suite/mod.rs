//! `dmp suite`: versions of a SLAM on several logs.

mod arguments;
mod contents;
mod dask;
mod file;
mod kept;
mod list;
mod paths;
mod plan;
mod render;
mod scored;

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::bail;
use clap::Args;
use dmp::{SuiteReport, suite_report};
use dmp_disk::folder_of;
use dmp_draw::suite_page;
use serde::Serialize;

use crate::clash::refuse_clashes;
use crate::common::Common;
use crate::exit::{Exit, Usage, when_printed};
use crate::gates::{self, GateReport, SuiteGateArgs};
use crate::save::save_text;
use crate::score::outputs::targets;
use crate::settings::ResourceArgs;
use crate::view::ViewArgs;
use file::{EXAMPLE, SuiteFile};
use kept::Kept;
use list::List;
use plan::Plan;
use scored::{Scoring, Unkept};

/// The folder of results, beside the suite.
const CACHE: &str = ".dmp-suite";

/// Compare versions of a SLAM over several logs
///
/// Scores all versions on each log together, as `dmp score` does, and tells of every pair of versions on how many logs one
/// is better, and whether that is beyond chance (exact sign test over the logs). Results are kept by what the log, the
/// trajectories and the settings are, so that only what changed is scored again.
#[derive(Debug, Args)]
#[command(
    override_usage = "dmp suite [OPTIONS] SUITE.toml",
    after_help = "Examples:\n  \
    dmp suite --example > suite.toml\n  \
    dmp suite suite.toml\n  \
    dmp suite suite.toml --report suite.html --json > suite.json\n  \
    dmp suite suite.toml --expect unbeaten:new --expect 'new:lost_logs<2' --junit suite.xml\n  \
    dmp suite suite.toml --dask tcp://scheduler:8786 --work /shared/scratch\n  \
    dmp suite suite.toml --list\n\n\
    Exit codes: 0 done; 1 failed; 2 wrong usage; 3 done, but a log could not be scored, a version has no run on one, or part of \
    one was lost; 4 done, but a gate failed."
)]
#[expect(clippy::struct_excessive_bools, reason = "each is a flag of the command line")]
pub(crate) struct SuiteArgs {
    /// The suite: a TOML file that names versions, logs and options. docs/suite.md has every key
    #[arg(value_name = "SUITE", required_unless_present = "example")]
    suite: Option<PathBuf>,
    /// Print an example of a suite, and do nothing else
    #[arg(long, conflicts_with_all = ["suite", "list", "json"])]
    example: bool,
    /// The folder that results are kept in; it is made if need be [default: .dmp-suite beside the suite]
    #[arg(long, value_name = "FOLDER", help_heading = "Cache")]
    cache: Option<PathBuf>,
    /// Score nothing: print as JSON which logs are not in the cache, each with the arguments of the command that scores it
    /// and the file that its output belongs into, for other programs to do so
    #[arg(long, conflicts_with_all = ["json", "report"], help_heading = "Cache")]
    list: bool,
    /// Score nothing: tell what the results in the cache say, and pass over logs without one
    #[arg(long, conflicts_with = "list", help_heading = "Cache")]
    cached: bool,

    #[command(flatten)]
    resources: ResourceArgs,
    /// Score on a cluster of Dask, whose scheduler has this address, as `tcp://HOST:8786`, several logs at once and large ones
    /// in parts. Logs and runs must be where all workers have them, and so must --work, which may be a URL (s3://); --memory and
    /// --threads are those of a task. It is done by the Python package: pip install 'dmp-slam[dask]'
    #[arg(long, value_name = "ADDRESS", conflicts_with_all = ["list", "cached"], help_heading = "Resources")]
    dask: Option<String>,

    /// Print one JSON object (schema dmp-suite/1) instead of tables
    #[arg(long, help_heading = "Output")]
    json: bool,
    /// Write a page to look at, FILE.html: the verdicts, every log with every pair. One file that needs no network
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    report: Option<PathBuf>,
    #[command(flatten)]
    view: ViewArgs,

    #[command(flatten)]
    gates: SuiteGateArgs,
}

/// The JSON: what was found, and what became of the gates.
#[derive(Debug, Serialize)]
struct Output<'a> {
    #[serde(flatten)]
    report: &'a SuiteReport,
    gates: &'a [GateReport],
}

pub(crate) fn run(arguments: &SuiteArgs, common: &Common, out: &mut impl Write) -> anyhow::Result<Exit> {
    let Some(path) = arguments.suite.as_deref().filter(|_| !arguments.example) else {
        out.write_all(EXAMPLE.as_bytes())?;
        return Ok(Exit::Done);
    };
    let file = SuiteFile::read(path)?;
    let plan = Plan::make(&file)?;
    let gates = arguments.gates.start(&file.versions, path, &file.gates)?;
    if let Some(page) = &arguments.report {
        targets::check_html(page)?;
        targets::writable(page)?;
    }
    let outputs: Vec<&Path> =
        arguments.report.as_deref().into_iter().chain(arguments.gates.junit()).collect();
    refuse_clashes(&outputs, &plan.inputs())?;
    let folder = arguments.cache.clone().unwrap_or_else(|| folder_of(path).join(CACHE));
    let mut kept = Kept::open(&folder, common)?;
    if arguments.list {
        List::of(&plan, &mut kept, common)?.print(out)?;
        return Ok(Exit::Done);
    }
    let unkept = match &arguments.dask {
        Some(address) => {
            let missing = List::of(&plan, &mut kept, common)?;
            dask::score(address, &missing, &arguments.resources, common)?;
            Unkept::Told
        }
        None if arguments.cached => Unkept::Told,
        None => Unkept::Scored(&arguments.resources),
    };
    let scoring = Scoring { unkept, common };
    let (logs, results) = scoring.all(&plan, &mut kept)?;
    if let Some(problem) = logs.iter().find_map(|log| log.report.as_ref().err())
        && logs.iter().all(|log| log.report.is_err())
    {
        bail!(Usage(format!("{}: no log was scored, the first because: {problem}", path.display())));
    }
    let mut report = suite_report(&file.versions, &logs, plan.confidence);
    for (log, result) in report.logs.iter_mut().zip(results) {
        log.result = result;
    }
    finish(arguments, &report, &gates, common, out)
}

fn finish(
    arguments: &SuiteArgs,
    report: &SuiteReport,
    gates: &gates::SuiteGates<'_>,
    common: &Common,
    out: &mut impl Write,
) -> anyhow::Result<Exit> {
    let checked = gates.check(report);
    let page = arguments.report.as_ref();
    let written =
        page.map_or(Ok(()), |path| save_text(path, &suite_page(report, &gates::failures(&checked))));
    let is_whole =
        |log: &dmp::SuiteLogReport| log.problem.is_none() && log.missing.is_empty() && !log.damaged;
    let done = if report.logs.iter().all(is_whole) { Exit::Done } else { Exit::InputDamaged };
    let exit = gates.end(&common.host, &checked, done)?;
    let printed = if arguments.json {
        let output = Output { report, gates: &checked };
        serde_json::to_writer_pretty(&mut *out, &output)
            .map_err(std::io::Error::from)
            .and_then(|()| writeln!(out))
    } else {
        render::report(out, report, common.terminal)
            .and_then(|()| gates::table(out, &checked, common.terminal))
    };
    // The result is told also where the page cannot be written.
    written?;
    arguments.view.open(arguments.report.as_deref(), &common.host);
    when_printed(printed.map_err(Into::into), exit)
}
