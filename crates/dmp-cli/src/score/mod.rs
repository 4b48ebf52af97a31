//! `dmp score`: score and rank runs.

mod against;
pub(crate) mod announce;
pub(crate) mod conventions;
mod details;
pub(crate) mod evaluation_args;
mod like;
pub(crate) mod outputs;
mod pairs;
pub(crate) mod parse;
mod promise;
mod quick;
mod ranked;
pub(crate) mod render;
mod sampling;

use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use dmp::{Confidence, Config, Report, ShardPlan, evaluate, file_stem_of};
use serde::Serialize;

use crate::clash::refuse_clashes;
use crate::common::Common;
use crate::exit::{Exit, when_printed};
use crate::gates::{self, GateArgs, GateReport};
use crate::named::maps_of;
use crate::runs::{OpenedRuns, Runs};
use crate::save::OutputsFolder;
use crate::settings::{ResourceArgs, ResumeArgs};
use crate::terminal::Terminal;
use evaluation_args::EvaluationArgs;
use outputs::{OutputArgs, Recorder};

/// Score runs on a log, and rank them
///
/// Fuses each run's map from the scans, casts every return into it and compares measured with predicted
/// ranges. No ground truth is needed. The scores compare runs of one log under one setting, nothing else.
#[derive(Debug, Args)]
#[command(
    override_usage = "dmp score [OPTIONS] LOG -t [NAME=]RUN.tum [-t [NAME=]RUN2.tum ...]",
    after_help = "Examples:\n  \
    dmp score drive.mcap -t runs/*.tum\n  \
    dmp score drive.mcap -t old=a/traj.tum -t new=b/traj.tum --extrinsic 0,0,0.28,0,0,0,1\n  \
    dmp score kitti/07/ -t poses.txt --every 5 --memory 2GiB\n  \
    dmp score city.mcap -t run.tum --resume\n  \
    dmp score city.mcap -t a.tum -t b.tum --quick\n  \
    dmp score city.mcap -t a.tum -t b.tum --sample 2%\n  \
    dmp score city.mcap -t a.tum -t b.tum -t c.tum --decide=a,b\n  \
    dmp score drive.mcap -t run.tum --map survey.laz --json > scores.json\n  \
    dmp score drive.mcap -t a.tum -t b.tum --residuals out.laz --per-frame frames.csv\n  \
    dmp score drive.mcap -t a.tum -t b.tum --report out.html --view --scene out.mcap\n  \
    dmp score drive.mcap -t topic:/odom -t slam=slam.mcap:/slam/path\n  \
    dmp score drive.mcap -t kiss=kiss_poses.npy --pose-at kiss=end\n  \
    dmp score drive.mcap -t old.tum -t new.tum --expect unbeaten:new --expect 'new:R_cv_0.5<15cm'\n  \
    dmp score drive.mcap -t a.tum -t b.tum --mend\n  \
    dmp score drive.mcap -t today.tum --like monday.dmp --keep today.dmp\n\n\
    Exit codes: 0 done; 1 failed; 2 wrong usage; 3 done, but part of the log was lost or damaged, or a run was left out; 4 done, but a gate \
    failed, whether part of the log was lost or not."
)]
pub(crate) struct ScoreArgs {
    #[command(flatten)]
    asked: EvaluationArgs,
    #[command(flatten)]
    resume: ResumeArgs,

    /// Print one JSON object (schema dmp-score/2) instead of tables
    #[arg(long, help_heading = "Output")]
    json: bool,
    /// Also print every scale of every pair, all scores, where returns went, times and memory
    #[arg(short, long, conflicts_with = "json", help_heading = "Output")]
    verbose: bool,
    /// Keep the fused maps in this folder, as NAME.dmpmap; it is made if need be
    #[arg(long, value_name = "FOLDER", help_heading = "Output")]
    save_maps: Option<PathBuf>,
    #[command(flatten)]
    outputs: OutputArgs,

    #[command(flatten)]
    gates: GateArgs,
}

/// The JSON: what was found, and what became of the gates.
#[derive(Debug, Serialize)]
struct Scored<'a> {
    #[serde(flatten)]
    report: &'a Report,
    gates: &'a [GateReport],
}

impl ScoreArgs {
    fn config(&self) -> Config {
        let per_tile = self.outputs.per_tile();
        Config { save_maps: self.save_maps.clone(), per_tile, ..self.resume.in_config(self.asked.config()) }
    }

    /// How sure the verdicts are to be.
    pub(crate) fn confidence(&self) -> Confidence {
        self.config().confidence
    }

    /// Whether `dmp shard` does it, too.
    pub(crate) fn is_in_parts(&self) -> bool {
        let is_whole = self.asked.sampling.quick().is_some() || !self.asked.maps.is_empty();
        !is_whole && ShardPlan::check_settings(&self.config()).is_ok()
    }

    /// The same, with these means.
    pub(crate) fn with_resources(mut self, resources: &ResourceArgs) -> Self {
        self.asked.settings.resources = resources.clone();
        self
    }
}

pub(crate) fn run(arguments: &ScoreArgs, common: &Common, out: &mut impl Write) -> anyhow::Result<Exit> {
    let asked = &arguments.asked;
    let (config, like) = asked.like_in(arguments.config())?;
    // What is short comes first, so that a mistake in it is told before a long log is read.
    let started = Runs::start(&asked.files(), &asked.reading)?;
    let maps = maps_of(&started.names(), &asked.maps)?;
    let outputs = arguments.outputs.plan(&started.names(), &asked.inputs())?;
    let gates = arguments.gates.start(&started.names())?;
    let mut _taken = None;
    if let Some(folder) = &arguments.save_maps {
        _taken = Some(OutputsFolder::take(folder)?);
        let names = started.names();
        let of_run = |name: &&str| folder.join(format!("{}.dmpmap", file_stem_of(&names, name)));
        refuse_clashes(&names.iter().map(of_run).collect::<Vec<_>>(), &asked.inputs())?;
    }
    let quick =
        asked.sampling.quick().map(|share| quick::score(asked, &config, share, common)).transpose()?;
    let (report, damaged, recorded) = if let Some((report, damaged)) = quick.flatten() {
        (report, damaged, None)
    } else {
        let opened =
            OpenedRuns::open(started, maps, &asked.log, asked.settings.poses(), config.threads, common)?;
        like.iter().try_for_each(|like| like.check_log(opened.log.summary()))?;
        let (OpenedRuns { log, runs, damaged }, vetted) =
            asked.conventions.vet(opened, &asked.log, asked.settings.poses(), &config, common)?;
        let (settings, means) = config.on(log.summary())?;
        let outputs = match &vetted {
            Some(vetted) => outputs.of_runs(&vetted.is_kept()),
            None => outputs,
        };
        let recorder = Recorder::new(outputs, log.as_ref(), &runs, (&settings, &means), common)?;
        let evaluated = evaluate(log.as_ref(), &runs, &config, (&recorder, &recorder));
        let evaluated = evaluated.map(|report| conventions::told(report, vetted.as_ref()));
        let (report, recorded) = recorder.end(evaluated)?;
        (report, damaged, Some(recorded))
    };
    let checked = gates.check(&report);
    let remarks = gates::failures(&checked);
    let written = match (recorded, &arguments.outputs.report) {
        (Some(recorded), _) => recorded.write(&report, &remarks, common.quiet),
        (None, Some(path)) => outputs::page::write(path, &report, None, None, &remarks).map(drop),
        (None, None) => Ok(()),
    };
    // Before the output, which somebody may stop reading.
    let incomplete = damaged || !report.left_out.is_empty();
    let exit = gates.end(
        &common.host,
        &report,
        &checked,
        if incomplete { Exit::InputDamaged } else { Exit::Done },
    )?;
    let printed = print(out, &report, &checked, (arguments.json, arguments.verbose), common.terminal);
    // Scores are told also where files cannot be written.
    written?;
    if !common.quiet {
        announce::done(&common.host, &report);
    }
    arguments.outputs.view.open(arguments.outputs.report.as_deref(), &common.host);
    when_printed(printed, exit)
}

/// Prints a report, as JSON or as tables, perhaps all of them.
pub(crate) fn print(
    out: &mut impl Write,
    report: &Report,
    gates: &[GateReport],
    (json, verbose): (bool, bool),
    terminal: Terminal,
) -> anyhow::Result<()> {
    if json {
        serde_json::to_writer_pretty(&mut *out, &Scored { report, gates }).map_err(std::io::Error::from)?;
        return Ok(writeln!(out)?);
    }
    render::report(out, report, verbose, terminal)?;
    gates::table(out, gates, terminal)?;
    // Before what is said when all is done.
    Ok(out.flush()?)
}
