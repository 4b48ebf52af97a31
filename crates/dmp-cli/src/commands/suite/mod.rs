//! `dmp suite`: versions of a SLAM on several logs.

mod cache_key;
mod dask;
mod file;
mod kept;
mod list;
mod options;
mod paths;
mod plan;
mod render;
mod scored;

use std::io::Write;
use std::path::Path;

use clap::{Args as _, FromArgMatches as _};
use dmp_disk::folder_of;
use dmp_draw::suite_page;
use dmp_suite::{SuiteReport, suite_report};
use serde::Serialize;

use super::score::outputs::targets;
use crate::console::{Common, Exit, Usage, say, when_printed};
use crate::files::{refuse_clashes, save_text};
use crate::gates::{self, GateReport, SuiteGateArgs};
use crate::options::{Asked, Out, Spec, output, scoring, tools};
use file::{EXAMPLE, SuiteFile};
use kept::Kept;
use list::List;
use plan::Plan;
use scored::{Scoring, Unkept};

/// The folder of results, beside the suite.
const CACHE: &str = ".dmp-suite";

pub(crate) static SPEC: Spec = Spec {
    name: "suite",
    about: "Compare versions of a SLAM over several logs",
    more: "Scores all versions on each log together, as `dmp score` does. Reports for each pair of versions on how many logs one \
           is better, and whether that is significant (exact sign test over the logs). Results are cached by the contents of the \
           log, the trajectories and the settings: only what changed is scored again.",
    usage: "dmp suite [OPTIONS] SUITE.toml",
    after: "Examples:\n  \
            dmp suite --example > suite.toml\n  \
            dmp suite suite.toml\n  \
            dmp suite suite.toml --report suite.html --json > suite.json\n  \
            dmp suite suite.toml --dask tcp://scheduler:8786 --work /shared/scratch\n  \
            dmp suite suite.toml --list\n\n\
            Exit codes: 0 done; 1 failed; 2 wrong usage; 3 done, but a log could not be scored, a version has no run on one, or \
            part of one was lost; 4 done, but a gate failed.",
    options: &[
        &[&tools::SUITE, &tools::EXAMPLE, &tools::FAILURES, &tools::CACHE, &tools::LIST, &tools::CACHED],
        scoring::MEANS,
        &[&tools::DASK, &output::JSON, &output::REPORT],
    ],
    extend: SuiteGateArgs::augment_args,
    run,
    ..Spec::EMPTY
};

/// The JSON: what was found, and the results of the gates.
#[derive(Debug, Serialize)]
struct Output<'a> {
    #[serde(flatten)]
    report: &'a SuiteReport,
    gates: &'a [GateReport],
}

fn run(asked: &Asked, common: &Common, out: &mut Out<'_>) -> anyhow::Result<Exit> {
    let Some(path) = asked.get(&tools::SUITE).filter(|_| !asked.has(&tools::EXAMPLE)) else {
        out.write_all(EXAMPLE.as_bytes())?;
        return Ok(Exit::Done);
    };
    let file = SuiteFile::read(&path)?;
    let failures = asked.get(&tools::FAILURES).unwrap_or_default();
    let plan = Plan::make(&file, failures)?;
    let gate_args = SuiteGateArgs::from_arg_matches(asked.matches())?;
    let gates = gate_args.start(&file.versions, &path, &file.gates)?;
    let page = asked.get(&output::REPORT);
    if let Some(page) = &page {
        targets::check_html(page)?;
        targets::writable(page)?;
    }
    let outputs: Vec<&Path> = page.as_deref().into_iter().chain(gate_args.junit()).collect();
    refuse_clashes(&outputs, &plan.inputs())?;
    let folder = asked.get(&tools::CACHE).unwrap_or_else(|| folder_of(&path).join(CACHE));
    let mut kept = Kept::open(&folder, common)?;
    if asked.has(&tools::LIST) {
        say::json(out, &List::of(&plan, &mut kept, common)?)?;
        return Ok(Exit::Done);
    }
    let unkept = match asked.get(&tools::DASK) {
        Some(address) => {
            let missing = List::of(&plan, &mut kept, common)?;
            dask::score(&address, &missing, asked, common)?;
            Unkept::Skipped
        }
        None if asked.has(&tools::CACHED) => Unkept::Skipped,
        None => Unkept::Scored(asked),
    };
    let scoring = Scoring { unkept, common };
    let (logs, results) = scoring.all(&plan, &mut kept)?;
    if let Some(problem) = logs.iter().find_map(|log| log.report.as_ref().err())
        && logs.iter().all(|log| log.report.is_err())
    {
        let why = format!("{}: no log was scored, the first because: {problem}", path.display());
        // Elsewhere it is the fault of the logs.
        return Err(if asked.has(&tools::CACHED) { Usage(why).into() } else { anyhow::Error::msg(why) });
    }
    let mut report = suite_report(&file.versions, &logs, plan.confidence, failures);
    for (log, result) in report.logs.iter_mut().zip(results) {
        log.result = result;
    }
    finish(asked, &report, &gates, common, out)
}

fn finish(
    asked: &Asked,
    report: &SuiteReport,
    gates: &gates::SuiteGates<'_>,
    common: &Common,
    out: &mut impl Write,
) -> anyhow::Result<Exit> {
    let checked = gates.check(report);
    let page = asked.get(&output::REPORT);
    let written =
        page.as_ref().map_or(Ok(()), |path| save_text(path, &suite_page(report, &gates::failures(&checked))));
    let is_whole =
        |log: &dmp_suite::SuiteLogReport| log.problem.is_none() && log.missing.is_empty() && !log.damaged;
    let done = if report.logs.iter().all(is_whole) { Exit::Done } else { Exit::InputDamaged };
    let exit = gates.end(&common.host, &checked, done)?;
    let printed = if asked.has(&output::JSON) {
        let output = Output { report, gates: &checked };
        say::json(out, &output)
    } else {
        render::report(out, report, common.terminal)
            .and_then(|()| gates::table(out, &checked, common.terminal))
    };
    // The result is printed also where the page cannot be written.
    written?;
    when_printed(printed.map_err(Into::into), exit)
}
