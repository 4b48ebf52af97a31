//! `dmp score`: score and rank runs.

mod details;
pub(crate) mod outputs;
mod pairs;
mod quick;
mod ranked;
pub(crate) mod render;
mod whole;

use std::io::Write;
use std::path::PathBuf;

use clap::{Args as _, FromArgMatches as _};
use dmp::{CastReturns, Config, Report};
use serde::Serialize;

use crate::console::{Common, Exit, Terminal, one_line, say, when_printed};
use crate::gates::{self, GateArgs, GateReport};
use crate::inputs::{LogInput, Runs, announce};
use crate::named::maps_of;
use crate::options::{Asked, Out, Spec, input, output, scoring};
use outputs::Outputs;
use whole::ScoredRuns;

pub(crate) static SPEC: Spec = Spec {
    name: "score",
    about: "Score runs on a log, and rank them",
    more: "Fuses each run's map from the scans, casts every return into it and compares measured with predicted ranges. No \
           ground truth is needed. Scores compare runs of one log under the same settings only.",
    usage: "dmp score [OPTIONS] LOG -t [NAME=]RUN.tum [-t [NAME=]RUN2.tum ...]",
    after: "Examples:\n  \
            dmp score drive.mcap -t runs/*.tum\n  \
            dmp score drive.mcap -t old=a/traj.tum -t new=b/traj.tum --extrinsic 0,0,0.28,0,0,0,1\n  \
            dmp score kitti/07/ -t poses.txt --every 5 --memory 2GiB\n  \
            dmp score city.mcap -t run.tum --resume\n  \
            dmp score city.mcap -t a.tum -t b.tum --quick\n  \
            dmp score drive.mcap -t run.tum --map survey.laz --json > scores.json\n  \
            dmp score drive.mcap -t a.tum -t b.tum --report out.html --scene out.mcap --per-frame frames.csv\n  \
            dmp score drive.mcap -t topic:/odom -t slam=slam.mcap:/slam/path\n  \
            dmp score drive.mcap -t kiss=kiss_poses.npy --pose-at kiss=end\n  \
            dmp score drive.mcap -t old.tum -t new.tum --expect unbeaten:new --junit gates.xml\n  \
            dmp score drive.mcap -t a.tum -t b.tum --mend\n  \
            dmp score drive.mcap -t today.tum --keep today.dmp\n\n\
            Exit codes: 0 done; 1 failed; 2 wrong usage; 3 done, but part of the log was lost or damaged, or a run was \
            excluded; 4 done, but a gate failed; 5 done, but a file beside the scores could not be written.",
    options: &[
        input::RUNS_ON_LOG,
        scoring::MAPPING,
        scoring::EVALUATION,
        &[&scoring::QUICK],
        input::CHECKS,
        scoring::MEANS,
        &[&scoring::RESUME],
        output::OF_SCORE,
    ],
    extend: GateArgs::augment_args,
    has_short_help: true,
    run,
    ..Spec::EMPTY
};

/// The JSON: what was found, and the results of the gates.
#[derive(Debug, Serialize)]
struct Scored<'a> {
    #[serde(flatten)]
    report: &'a Report,
    gates: &'a [GateReport],
}

/// The settings that were asked for.
pub(crate) fn config(asked: &Asked) -> anyhow::Result<Config> {
    let config = asked.config();
    config.check()?;
    Ok(config)
}

/// Every file that is read, as it was named.
fn inputs(asked: &Asked, log: &LogInput) -> Vec<PathBuf> {
    let files = Runs::files(asked).into_iter().chain(asked.all(&input::MAPS)).map(|file| file.path);
    std::iter::once(log.path.clone()).chain(files).collect()
}

pub(crate) fn run(asked: &Asked, common: &Common, out: &mut Out<'_>) -> anyhow::Result<Exit> {
    let mut config = config(asked)?;
    if !asked.all(&output::RESIDUALS).is_empty() && asked.get(&scoring::RETURNS).is_none() {
        config.returns = CastReturns::OneIn(1);
    }
    let log = LogInput::of(asked)?;
    // What is short comes first, so that a mistake in it is reported before a long log is read.
    let started = Runs::start_some(asked)?;
    let maps = maps_of(&started.names(), &asked.all(&input::MAPS))?;
    let outputs = Outputs::of(asked, &started.names(), &inputs(asked, &log))?;
    let gate_args = GateArgs::from_arg_matches(asked.matches())?;
    let gates = gate_args.start(&started.names())?;
    let quick = if asked.has(&scoring::QUICK) {
        quick::score(asked, (&log, started), &config, common)?
    } else {
        Err(started)
    };
    let ScoredRuns { report, damaged, recorded } = match quick {
        Ok(scored) => scored,
        Err(started) => whole::score(asked, (&log, started, maps), outputs, &config, common)?,
    };
    let checked = gates.check(&report);
    let remarks = gates::failures(&checked);
    let unwritten = match (recorded, asked.get(&output::REPORT)) {
        (Some(recorded), _) => recorded.write(&report, &remarks, common.quiet)?,
        (None, Some(path)) => {
            outputs::page::write(&path, &report, None, None, &remarks).err().into_iter().collect()
        }
        (None, None) => Vec::new(),
    };
    // Before the output, which somebody may stop reading.
    let incomplete = damaged || !report.left_out.is_empty();
    let exit = gates.end(
        &common.host,
        &report,
        &checked,
        if incomplete { Exit::InputDamaged } else { Exit::Done },
    )?;
    let printed = print(out, &report, &checked, asked, common.terminal);
    if !common.quiet {
        announce::done(&common.host, &report);
    }
    // Scores are valid also where files beside them cannot be written.
    for problem in &unwritten {
        say!(common.host, "error: {}; the scores are complete", one_line(problem));
    }
    when_printed(printed, if unwritten.is_empty() { exit } else { Exit::OutputFailed })
}

/// Prints a report, as JSON or as tables, perhaps all of them.
pub(crate) fn print(
    out: &mut impl Write,
    report: &Report,
    gates: &[GateReport],
    asked: &Asked,
    terminal: Terminal,
) -> anyhow::Result<()> {
    if asked.has(&output::JSON) {
        return Ok(say::json(out, &Scored { report, gates })?);
    }
    render::report(out, report, asked.has(&output::VERBOSE), terminal)?;
    gates::table(out, gates, terminal)?;
    // Before the messages at the end.
    Ok(out.flush()?)
}
