//! `dmp score`: score and rank runs.

pub(crate) mod announce;
pub(crate) mod conventions;
mod details;
mod like;
pub(crate) mod outputs;
mod pairs;
pub(crate) mod parse;
mod promise;
pub(crate) mod render;
mod sampling;

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::bail;
use clap::Args;
use dmp::{Confidence, Config, DriftPairs, Report, evaluate, evaluate_quick, file_stem_of};
use serde::Serialize;

use crate::clash::refuse_clashes;
use crate::common::Common;
use crate::drift::drift_pairs;
use crate::exit::{Exit, Usage, when_printed};
use crate::gates::{self, GateArgs, GateReport};
use crate::log_args::LogArgs;
use crate::named::{NamedFile, maps_of};
use crate::progress::Progress;
use crate::runs::{OpenedRuns, Runs};
use crate::save::OutputsFolder;
use crate::settings::{ResourceArgs, ResumeArgs, SettingsArgs};
use crate::trajectory_args::TrajectoryArgs;
use conventions::ConventionArgs;
use like::Like;
use outputs::{OutputArgs, Recorder};
use promise::PromiseArgs;
use sampling::SamplingArgs;

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
    dmp score drive.mcap -t topic:/odom -t slam=slam.mcap:/slam/path\n  \
    dmp score drive.mcap -t kiss=kiss_poses.npy --pose-at kiss=end\n  \
    dmp score drive.mcap -t old.tum -t new.tum --expect-unbeaten new --fail-above new:R_cv_0.5=15cm\n  \
    dmp score drive.mcap -t a.tum -t b.tum --mend\n  \
    dmp score drive.mcap -t today.tum --like monday.json --json > today.json\n\n\
    Exit codes: 0 done; 1 failed; 2 wrong usage; 3 done, but part of the log was lost or damaged, or a run was left out; 4 done, but a gate \
    failed, whether part of the log was lost or not."
)]
pub(crate) struct ScoreArgs {
    /// A run to score: its trajectory, world_from_body in metres. A file (TUM, KITTI rows, EuRoC, .npy, g2o),
    /// `topic:/odom` of the log, or `BAG:/odom` of another bag (odometry, poses, a path; of frames,
    /// `topic:/tf:WORLD:BODY`). Called NAME, or like the file
    #[arg(short = 't', long = "trajectory", value_name = "[NAME=]RUN", help_heading = "Input")]
    #[arg(required_unless_present = "more")]
    trajectories: Vec<NamedFile>,
    #[command(flatten)]
    reading: TrajectoryArgs,
    /// A map to score against instead of the one fused from the scans: LAS, LAZ, PLY, PCD, a mesh in PLY or
    /// OBJ, or a saved map, in the world frame of the run NAME, or of all runs
    #[arg(long = "map", value_name = "[NAME=]FILE", help_heading = "Input")]
    maps: Vec<NamedFile>,
    /// The unit of the clouds and meshes given with --map: `auto` (what the file says, else metres), `m`, `ft`
    /// or `us-ft`
    #[arg(long, value_name = "UNIT", default_value = "auto", help_heading = "Input")]
    map_unit: parse::AutoUnit,
    #[command(flatten)]
    log: LogArgs,
    /// More runs: what a shell makes of `-t runs/*.tum`
    #[arg(value_name = "[NAME=]RUN", hide = true)]
    more: Vec<NamedFile>,
    #[command(flatten)]
    settings: SettingsArgs,
    /// Score as this result of `dmp score --json` of the same log was made, so that `dmp compare` takes both: with its
    /// voxel, segments, ranges, vehicle, every N-th scan, price of a miss, range noise, sampled scans and confidence
    #[arg(long, value_name = "RESULT", conflicts_with_all = like::TAKEN, help_heading = "Input")]
    like: Option<PathBuf>,
    #[command(flatten)]
    conventions: ConventionArgs,
    #[command(flatten)]
    promise: PromiseArgs,
    #[command(flatten)]
    sampling: SamplingArgs,
    /// Measure drift in metres on so many pairs of visits to the same places at most, on `all`, or on `none`, as `dmp drift`
    /// does. Without this one for each two segments, and none where a sample is scored; `--drift` alone is all
    #[arg(long, value_name = "N", num_args = 0..=1, require_equals = true, default_missing_value = "all")]
    #[arg(value_parser = drift_pairs, conflicts_with = "quick", help_heading = "Returns and map")]
    drift: Option<DriftPairs>,

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
        let settings =
            Config { save_maps: self.save_maps.clone(), map_unit: self.map_unit.0, ..self.settings.config() };
        let config = self.promise.of(self.sampling.of(self.resume.in_config(settings)));
        Config { drift: self.drift.unwrap_or_default(), ..config }
    }

    /// How sure the verdicts are to be.
    pub(crate) fn confidence(&self) -> Confidence {
        self.config().confidence
    }

    /// The same, with these means.
    pub(crate) fn with_resources(mut self, resources: &ResourceArgs) -> Self {
        self.settings.resources = resources.clone();
        self
    }

    /// Every file that is read, as it was named.
    fn inputs(&self) -> Vec<&Path> {
        let named = self.trajectories.iter().chain(&self.more).chain(&self.maps);
        let named = named.map(|file| file.path.as_path()).chain(self.like.as_deref());
        std::iter::once(self.log.path()).chain(named).collect()
    }
}

pub(crate) fn run(arguments: &ScoreArgs, common: &Common, out: &mut impl Write) -> anyhow::Result<Exit> {
    let like = arguments.like.as_deref().map(Like::read).transpose()?;
    let config = arguments.config();
    let config = like.iter().try_fold(config, |config, like| like.settings(config))?;
    config.check()?;
    // What is short comes first, so that a mistake in it is told before a long log is read.
    let files: Vec<NamedFile> = arguments.trajectories.iter().chain(&arguments.more).cloned().collect();
    let started = Runs::start(&files, &arguments.reading)?;
    let maps = maps_of(&started.names(), &arguments.maps)?;
    let outputs = arguments.outputs.plan(&started.names(), &arguments.inputs())?;
    let gates = arguments.gates.start(&started.names())?;
    let mut _taken = None;
    if let Some(folder) = &arguments.save_maps {
        _taken = Some(OutputsFolder::take(folder)?);
        let names = started.names();
        let of_run = |name: &&str| folder.join(format!("{}.dmpmap", file_stem_of(&names, name)));
        refuse_clashes(&names.iter().map(of_run).collect::<Vec<_>>(), &arguments.inputs())?;
    }
    let (report, damaged, recorded) = match arguments.sampling.quick() {
        None => {
            let opened = OpenedRuns::open(started, maps, &arguments.log, arguments.settings.poses(), common)?;
            let (OpenedRuns { log, runs, damaged }, vetted) = arguments.conventions.vet(
                opened,
                &arguments.log,
                arguments.settings.poses(),
                &config,
                common,
            )?;
            like.iter().try_for_each(|like| like.check_log(log.summary()))?;
            let (settings, means) = config.on(log.summary())?;
            if arguments.outputs.report.is_some() && !settings.scales.lengths().has_page {
                bail!(Usage(outputs::page::no_page(settings.scales)));
            }
            let outputs = match &vetted {
                Some(vetted) => outputs.of_runs(&vetted.is_kept()),
                None => outputs,
            };
            let recorder = Recorder::new(outputs, log.as_ref(), &runs, (&settings, &means), common)?;
            let evaluated = evaluate(log.as_ref(), &runs, &config, (&recorder, &recorder));
            let evaluated = evaluated.map(|report| conventions::told(report, vetted.as_ref()));
            let (report, recorded) = recorder.end(evaluated)?;
            (report, damaged, Some(recorded))
        }
        Some(share) => {
            let opened = OpenedRuns::outline(started, &arguments.log, arguments.settings.poses(), common)?;
            let (OpenedRuns { log, runs, damaged }, vetted) = arguments.conventions.vet_outline(
                opened,
                &arguments.log,
                arguments.settings.poses(),
                &config,
                common,
            )?;
            let config = Config { checkpoint_every: None, ..config };
            let report = evaluate_quick(&log, &runs, &config, share, &Progress::new(common))?;
            let report = conventions::told(report, vetted.as_ref());
            // What is lost shows where it is read.
            let damaged = damaged || !report.inputs.damage.is_empty();
            (report, damaged, None)
        }
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
    let printed = print(out, &report, &checked, arguments);
    // Scores are told also where files cannot be written.
    written?;
    if !common.quiet {
        announce::done(&common.host, &report);
    }
    when_printed(printed, exit)
}

fn print(
    out: &mut impl Write,
    report: &Report,
    gates: &[GateReport],
    arguments: &ScoreArgs,
) -> anyhow::Result<()> {
    if arguments.json {
        serde_json::to_writer_pretty(&mut *out, &Scored { report, gates }).map_err(std::io::Error::from)?;
        return Ok(writeln!(out)?);
    }
    render::report(out, report, arguments.verbose)?;
    gates::table(out, gates)?;
    // Before what is said when all is done.
    Ok(out.flush()?)
}
