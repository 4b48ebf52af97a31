//! `dmp compare`: results that were saved, beside each other.

use std::io::{self, Write};
use std::path::Path;

use anyhow::anyhow;
use clap::{Args as _, FromArgMatches as _};
use dmp::{Config, EvaluateError, Report};
use dmp_draw::text::counted;
use dmp_log::shown_path;
use dmp_suite::{JoinError, JoinedReport, MadeWith, NamedReport, SavedResult, join_results};
use serde::Serialize;

use super::score::outputs::{page, targets};
use super::score::render;
use crate::console::{Common, Exit, Progress, Terminal, Usage, say, when_printed};
use crate::files::read_with_returns;
use crate::gates::{self, GateArgs, GateReport};
use crate::named::{NamedFile, names_of};
use crate::options::{Asked, Out, Spec, output, tools};

/// So many pairs that no result holds are named.
const NOT_COMPARED: usize = 5;

pub(crate) static SPEC: Spec = Spec {
    name: "compare",
    about: "Compare saved results of `dmp score` of one log",
    more: "Prints the table of `dmp score` for the runs of all results. They must be of the same log, with the same version, \
           frames and settings, else the difference is reported. Runs of results of `dmp score \
           --keep` are all compared with each other by their scores, as if scored in one command; drift decides within a result; those with fused maps and those with given \
           ones apart. Of other results a pair is taken from one that holds both. Pairs that no result holds are not compared, \
           and ordered by the first column.",
    usage: "dmp compare [OPTIONS] [NAME=]RESULT [[NAME=]RESULT2 ...]",
    after: "Examples:\n  \
            dmp compare monday.dmp tuesday.dmp --expect unbeaten:tuesday/slam\n  \
            dmp compare monday.json tuesday.json\n  \
            dmp compare base=runs/1/scores.json new=runs/2/scores.json --expect 'new/slam:R_cv_0.5<15cm'\n\n\
            Exit codes: 0 done; 1 failed, as where results cannot be compared; 2 wrong usage; 3 done, but part of the log was \
            lost or damaged when it was scored; 4 done, but a gate failed.",
    options: &[&[&tools::RESULTS, &output::JSON, &output::REPORT, &output::VERBOSE, &tools::COMPARE_THREADS]],
    extend: GateArgs::augment_args,
    run,
    ..Spec::EMPTY
};

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

fn run(asked: &Asked, common: &Common, out: &mut Out<'_>) -> anyhow::Result<Exit> {
    let files = asked.all(&tools::RESULTS);
    let (names, page) = (names_of(&files)?, asked.get(&output::REPORT));
    if let Some(page) = &page {
        targets::check_html(page)?;
        targets::writable(page)?;
    }
    let read = |(file, name): (&NamedFile, String)| {
        let path = file.path.display().to_string();
        let (report, returns) = read_with_returns(&file.path)?;
        Ok(SavedResult { named: NamedReport { name, file: path, report }, returns })
    };
    let mut results = files.iter().zip(names).map(read).collect::<anyhow::Result<Vec<_>>>()?;
    let threads = asked.get(&tools::COMPARE_THREADS).unwrap_or_else(|| Config::default().threads);
    let joined = join_results(&mut results, threads, &Progress::new(common)).map_err(with_remedy)?;
    let JoinedReport { mut report, runs_of, not_compared } = joined;
    let runs: Vec<&str> = report.order.iter().map(String::as_str).collect();
    let gate_args = GateArgs::from_arg_matches(asked.matches())?;
    let gates = gate_args.start(&runs)?;
    let checked = gates.check(&report);
    let written = page.as_ref().map_or(Ok(()), |path| {
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
    let (verbose, terminal) = (asked.has(&output::VERBOSE), common.terminal);
    let printed = if asked.has(&output::JSON) {
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
        say::json(out, &output)
    } else {
        render::report(out, &report, verbose, terminal)
            .and_then(|()| not_compared_in_words(out, &not_compared, verbose, terminal))
            .and_then(|()| gates::table(out, &checked, terminal))
    };
    // The result is printed also where the page cannot be written.
    written?;
    when_printed(printed.map_err(Into::into), exit)
}

/// What can be done about results with different settings.
fn with_remedy(error: JoinError) -> anyhow::Error {
    match error {
        JoinError::Different { what, ref reports, .. }
            if !matches!(what, MadeWith::Log | MadeWith::Version) =>
        {
            anyhow!("{error}; score again with the settings of {}", reports[0])
        }
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
    let shown = if verbose { pairs.len() } else { pairs.len().min(NOT_COMPARED) };
    for [a, b] in &pairs[..shown] {
        terminal.tell(out, "  ", &format!("{a}, {b}"))?;
    }
    if shown < pairs.len() {
        let more = counted((pairs.len() - shown) as u64, "more pair");
        writeln!(out, "  {more}: -v or --json")?;
    }
    terminal.tell(
        out,
        "",
        "To compare them, keep both results with `dmp score --keep`, or score them in one command.",
    )
}
