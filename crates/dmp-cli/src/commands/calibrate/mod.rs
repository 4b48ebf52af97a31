//! `dmp calibrate`: when and where a run's poses hold, estimated from the scans themselves.

mod numbers;

use std::io::Write;

use dmp::{ConventionsReport, MapSource, Run, profiles};
use dmp_log::shown_path;
use serde::Serialize;

use crate::console::{Common, Exit, Progress, option_of, say, tell};
use crate::files::{OutputsFolder, SavedTogether};
use crate::inputs::{LogInput, OpenedRuns, Runs, vetting};
use crate::options::{Asked, Out, Spec, graph, input, output, scoring};

pub(crate) static SPEC: Spec = Spec {
    name: "calibrate",
    about: "Estimate when and where a run's poses hold",
    more: "Estimates errors of a run's clock and of the extrinsic from surfaces that several scans see: with the right values \
           these surfaces are thinnest. Reports each estimate with an interval, and what the scans do not determine: height \
           over flat ground, time on a straight road at constant speed. Needs no ground truth and no target. Each fix is \
           printed as an option of `dmp score`; `dmp score --mend` applies the same.",
    usage: "dmp calibrate [OPTIONS] LOG -t [NAME=]RUN.tum [-t [NAME=]RUN2.tum ...]",
    after: "Examples:\n  \
            dmp calibrate drive.mcap -t run.tum\n  \
            dmp calibrate drive.mcap -t kiss=kiss_poses.npy -t lio=lio.tum --extrinsic lio=0,0,0.28,0,0,0,1\n  \
            dmp calibrate drive.mcap -t run.tum --plots figures/\n  \
            dmp calibrate drive.mcap -t run.tum --json\n\n\
            Exit codes: 0 done; 1 failed; 2 wrong usage; 3 done, but part of the log was lost or damaged, or a run does not \
            belong to it.",
    options: &[input::RUNS_ON_LOG, scoring::RANGES, &[&output::JSON, &graph::PLOTS]],
    run,
    ..Spec::EMPTY
};

/// The JSON.
#[derive(Debug, Serialize)]
struct Found {
    schema: &'static str,
    dmp_version: &'static str,
    log: String,
    runs: Vec<FoundRun>,
    messages: Vec<String>,
}

/// A run in it.
#[derive(Debug, Serialize)]
struct FoundRun {
    name: String,
    belongs: bool,
    #[serde(flatten)]
    conventions: ConventionsReport,
}

fn run(asked: &Asked, common: &Common, out: &mut Out<'_>) -> anyhow::Result<Exit> {
    let started = Runs::start_some(asked)?;
    let config = asked.config();
    config.check()?;
    let plots = asked.get(&graph::PLOTS);
    let _plots = plots.as_deref().map(OutputsFolder::make).transpose()?;
    let log = LogInput::of(asked)?;
    let fused = std::iter::repeat(MapSource::Fused);
    let opened = OpenedRuns::open(started, fused, &log, asked, config.threads, common)?;
    let given: Vec<Run> = opened.runs.clone();
    let (opened, vetted) = vetting::with_log(opened, &log, false, &config, common)?;
    let OpenedRuns { log, unread, damaged, .. } = opened;
    if let Some(folder) = &plots {
        let progress = Progress::new(common);
        let mut pictures = SavedTogether::default();
        for profile in profiles(log.as_ref(), &given, &vetted.found, &config, &progress)? {
            let names: Vec<&str> = given.iter().map(|run| run.name.as_str()).collect();
            let path = folder.join(format!("{}.svg", profile.axis.name()));
            let picture = numbers::plot(&profile, &names).to_svg();
            pictures.add(&path, |out| out.write_all(picture.as_bytes()))?;
        }
        pictures.commit()?;
    }
    let found = Found {
        schema: "dmp-calibrate/1",
        dmp_version: env!("CARGO_PKG_VERSION"),
        log: shown_path(&log.summary().path),
        runs: vetted
            .found
            .iter()
            .map(|found| FoundRun {
                name: found.name.clone(),
                belongs: found.is_kept(),
                conventions: found.report(false, &option_of),
            })
            .collect(),
        messages: unread.into_iter().map(|run| run.reason).chain(vetted.messages_with(&option_of)).collect(),
    };
    if asked.has(&output::JSON) {
        say::json(out, &found)?;
    } else {
        for run in &found.runs {
            numbers::table(out, &run.name, &run.conventions)?;
        }
        if vetted.messages_with(&option_of).is_empty() {
            writeln!(out, "No error of clock, mounting or pose format is detected.")?;
        }
        found.messages.iter().try_for_each(|message| tell!(out, "{message}"))?;
    }
    let incomplete = damaged || found.runs.iter().any(|run| !run.belongs);
    Ok(if incomplete { Exit::InputDamaged } else { Exit::Done })
}
