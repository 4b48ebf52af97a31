//! `dmp compare`: results that were saved, beside each other.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use anyhow::anyhow;
use clap::Args;
use clap::builder::RangedU64ValueParser;
use dmp::{
    Config, EvaluateError, JoinError, JoinedReport, MadeWith, NamedReport, Report, SavedResult, join_results,
};
use dmp_draw::text::counted;
use dmp_log::shown_path;
use serde::Serialize;

use crate::common::Common;
use crate::exit::{Exit, Usage, when_printed};
use crate::gates::{self, GateArgs, GateReport};
use crate::named::{NamedFile, names_of};
use crate::progress::Progress;
use crate::saved_result::read_with_returns;
use crate::score::outputs::{page, targets};
use crate::score::render;
use crate::terminal::Terminal;
use crate::view::ViewArgs;

/// So many pairs that no result holds are told by name.
const NOT_COMPARED: usize = 5;

/// Compare saved results of `dmp score` of one log
///
/// Prints the table of `dmp score` for the runs of all results. They must have been made of the same log with the
/// same version, frames, segments and settings, or the difference is told: see `dmp score --like`. All runs of results that
/// `dmp score --keep` kept are compared with each other, as if they had been scored in one command, those with fused maps and those
/// with given ones apart. Of other results a
/// pair of runs is taken from one that holds both; what is left is not compared, and ordered by the first column.
#[derive(Debug, Args)]
#[command(
    override_usage = "dmp compare [OPTIONS] [NAME=]RESULT [[NAME=]RESULT2 ...]",
    after_help = "Examples:\n  \
    dmp compare monday.dmp tuesday.dmp --expect unbeaten:tuesday/slam\n  \
    dmp compare monday.json tuesday.json\n  \
    dmp compare base=runs/1/scores.json new=runs/2/scores.json --expect 'new/slam:R_cv_0.5<15cm'\n\n\
    Exit codes: 0 done; 1 failed, as where results cannot be compared; 2 wrong usage; 3 done, but part of the log was \
    lost or damaged when it was scored; 4 done, but a gate failed."
)]
pub(crate) struct CompareArgs {
    /// What `dmp score` kept with --keep, or printed with --json. Called NAME, or like the file: it stands in front of the name of a
    /// run that another result has too, with other scores, as NAME/RUN
    #[arg(value_name = "[NAME=]RESULT", required = true)]
    results: Vec<NamedFile>,

    /// Print one JSON object (schema dmp-compare/1) instead of tables
    #[arg(long, help_heading = "Output")]
    json: bool,
    /// Write a page to look at, FILE.html: the ranking in words, scores, settings. Where runs are wrong is not in saved
    /// results: see `dmp score --report`
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    report: Option<PathBuf>,
    #[command(flatten)]
    view: ViewArgs,
    /// Also print every scale of every pair, all scores, where returns went, times and memory
    #[arg(short, long, conflicts_with = "json", help_heading = "Output")]
    verbose: bool,

    /// Threads that compare returns that were kept [default: one for each core]
    #[arg(long, value_name = "N", help_heading = "Resources")]
    #[arg(value_parser = RangedU64ValueParser::<usize>::new().range(1..=1024))]
    threads: Option<usize>,

    #[command(flatten)]
    gates: GateArgs,
}

/// The JSON: a report of all runs, and where they are from.
#[derive(Debug, Serialize)]
struct Output<'a> {
    #[serde(flatten)]
    report: &'a Report,
    /// The results, as they were given.
    results: Vec<ResultReport>,
    /// Pairs that no result holds.
    not_compared: &'a [[String; 2]],
    gates: &'a [GateReport],
}

/// One of the results.
#[derive(Debug, Serialize)]
struct ResultReport {
    name: String,
    file: String,
    /// The log, as it was called when it was scored.
    log: String,
    /// What its runs are called here.
    runs: Vec<String>,
}

pub(crate) fn run(arguments: &CompareArgs, common: &Common, out: &mut impl Write) -> anyhow::Result<Exit> {
    let names = names_of(&arguments.results)?;
    if let Some(page) = &arguments.report {
        targets::check_html(page)?;
        targets::writable(page)?;
    }
    let read = |(file, name): (&NamedFile, String)| {
        let path = file.path.display().to_string();
        let (report, returns) = read_with_returns(&file.path)?;
        Ok(SavedResult { named: NamedReport { name, file: path, report }, returns })
    };
    let mut results = arguments.results.iter().zip(names).map(read).collect::<anyhow::Result<Vec<_>>>()?;
    let threads = arguments.threads.unwrap_or_else(|| Config::default().threads);
    let joined = join_results(&mut results, threads, &Progress::new(common)).map_err(with_remedy)?;
    let JoinedReport { mut report, runs_of, not_compared } = joined;
    let runs: Vec<&str> = report.order.iter().map(String::as_str).collect();
    let gates = arguments.gates.start(&runs)?;
    let checked = gates.check(&report);
    let written = arguments.report.as_ref().map_or(Ok(()), |path| {
        let mut remarks = gates::failures(&checked);
        let not_compared = not_compared
            .iter()
            .map(|[a, b]| format!("Not compared, as no result holds both, nor was each kept: {a}, {b}"));
        remarks.extend(not_compared);
        page::write(path, &report, None, None, &remarks).map(drop)
    });
    let damaged = !report.inputs.damage.is_empty();
    let exit =
        gates.end(&common.host, &report, &checked, if damaged { Exit::InputDamaged } else { Exit::Done })?;
    let printed = if arguments.json {
        "dmp-compare/1".clone_into(&mut report.schema);
        env!("CARGO_PKG_VERSION").clone_into(&mut report.dmp_version);
        let of_result = |(SavedResult { named, .. }, runs): (&SavedResult, &Vec<String>)| ResultReport {
            name: named.name.clone(),
            file: shown_path(Path::new(&named.file)),
            log: named.report.inputs.log.clone(),
            runs: runs.clone(),
        };
        let results = results.iter().zip(&runs_of).map(of_result).collect();
        let output = Output { report: &report, results, not_compared: &not_compared, gates: &checked };
        json(out, &output)
    } else {
        let terminal = common.terminal;
        render::report(out, &report, arguments.verbose, terminal)
            .and_then(|()| not_compared_in_words(out, &not_compared, arguments.verbose, terminal))
            .and_then(|()| gates::table(out, &checked, terminal))
    };
    // The result is told also where the page cannot be written.
    written?;
    arguments.view.open(arguments.report.as_deref(), &common.host);
    when_printed(printed.map_err(Into::into), exit)
}

fn json(out: &mut impl Write, output: &Output<'_>) -> io::Result<()> {
    serde_json::to_writer_pretty(&mut *out, output).map_err(io::Error::from)?;
    writeln!(out)
}

/// What can be done about results that were not made alike.
fn with_remedy(error: JoinError) -> anyhow::Error {
    match error {
        JoinError::Different { what, ref reports, .. }
            if !matches!(what, MadeWith::Log | MadeWith::Version) =>
        {
            anyhow!("{error}; `dmp score --like {}` makes results that can be compared with it", reports[0])
        }
        JoinError::OfPlaces { report } => anyhow!(
            "{report}: made with --quick, where places and their maps depend on all runs of a command: score runs in one \
             to compare them"
        ),
        JoinError::Cancelled => EvaluateError::Cancelled.into(),
        JoinError::Log(error) => error.into(),
        JoinError::SameName { .. } => Usage(format!("{error}, as NAME=FILE")).into(),
        error => error.into(),
    }
}

/// Which runs stand where they do by the first column alone.
fn not_compared_in_words(
    out: &mut impl Write,
    pairs: &[[String; 2]],
    verbose: bool,
    terminal: Terminal,
) -> io::Result<()> {
    if pairs.is_empty() {
        return Ok(());
    }
    writeln!(
        out,
        "\nNot compared: no result holds both runs, nor was each kept; only the first score orders them"
    )?;
    let told = if verbose { pairs.len() } else { pairs.len().min(NOT_COMPARED) };
    for [a, b] in &pairs[..told] {
        terminal.tell(out, "  ", &format!("{a}, {b}"))?;
    }
    if told < pairs.len() {
        let more = counted((pairs.len() - told) as u64, "more pair");
        writeln!(out, "  {more}: -v or --json")?;
    }
    terminal.tell(
        out,
        "",
        "To compare them, keep both results with `dmp score --keep`, or score them in one command.",
    )
}
