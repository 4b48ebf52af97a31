//! `dmp shard plan`: decides on everything that parts must agree on.

use dmp_draw::text::counted;
use std::ffi::OsString;
use std::io::Write;
use std::path::PathBuf;

use anyhow::bail;
use clap::Args;
use dmp::{Config, Machine, MapSource, ShardPlan, VetSummary};

use super::document::{self, told};
use crate::common::Common;
use crate::exit::{Exit, Usage, option_of, when_printed};
use crate::named::maps_of;
use crate::progress::Progress;
use crate::runs::{OpenedRuns, Runs};
use crate::save::OutputsFolder;
use crate::score::evaluation_args::EvaluationArgs;

/// Plan a score in parts: which scans lie where in the log, which returns are used, voxels and segments
///
/// Reads the log once, as `dmp score` does before it fuses, and writes plan.json and the runs to a folder, where the files of all
/// parts will lie. What part of the log is damaged is told here.
#[derive(Debug, Args)]
#[command(
    override_usage = "dmp shard plan [OPTIONS] LOG -t [NAME=]RUN.tum [-t [NAME=]RUN2.tum ...] -o FOLDER",
    after_help = "Examples:\n  \
    dmp shard plan drive.mcap -t runs/*.tum -o work\n  \
    dmp shard plan city.mcap -t a.tum -t b.tum -o work --cores 256\n\n\
    Exit codes: 0 done; 1 failed; 2 wrong usage; 3 done, but part of the log was lost or damaged, or a run was left out."
)]
pub(crate) struct PlanArgs {
    #[command(flatten)]
    asked: EvaluationArgs,
    /// Folder for the plan, and for the files of its parts; it is made if need be
    #[arg(short, long, value_name = "FOLDER", help_heading = "Output")]
    output: PathBuf,
    /// Cores that parts will be done on, of all machines together: the plan says how many parts make sense for them
    #[arg(long, value_name = "N", default_value_t = 8, help_heading = "Resources")]
    #[arg(value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    cores: u32,
    #[command(flatten)]
    whole: WholeArgs,
}

/// Options of `dmp score` that parts do not have: refused by name.
#[derive(Debug, Args)]
struct WholeArgs {
    #[arg(long, hide = true)]
    report: Option<OsString>,
    #[arg(long, hide = true)]
    view: bool,
    #[arg(long, hide = true)]
    scene: Option<OsString>,
    #[arg(long, hide = true)]
    keep: Option<OsString>,
    #[arg(long, hide = true)]
    residuals: Vec<OsString>,
    #[arg(long, hide = true)]
    per_frame: Option<OsString>,
    #[arg(long, hide = true)]
    per_tile: Option<OsString>,
    #[arg(long, hide = true)]
    save_maps: Option<OsString>,
    #[arg(long, hide = true)]
    resume: bool,
    #[arg(long, hide = true)]
    checkpoint: Option<OsString>,
}

impl WholeArgs {
    fn check(&self, asked: &EvaluationArgs) -> anyhow::Result<()> {
        let returns = "it is made of single returns, which no part keeps: `dmp score` makes it";
        let refused = [
            (self.report.is_some(), "--report", returns),
            (self.view, "--view", "it opens the page of --report, which `dmp score` makes"),
            (self.scene.is_some(), "--scene", returns),
            (self.keep.is_some(), "--keep", returns),
            (!self.residuals.is_empty(), "--residuals", returns),
            (self.per_frame.is_some(), "--per-frame", returns),
            (self.per_tile.is_some(), "--per-tile", returns),
            (self.save_maps.is_some(), "--save-maps", "maps lie in pieces: `dmp map build` makes one"),
            (self.resume, "--resume", "a part that is not done is done again"),
            (self.checkpoint.is_some(), "--checkpoint", "a part that is not done is done again"),
            (
                asked.sampling.quick().is_some(),
                "--quick",
                "it reads a small part of the log: `dmp score` does it",
            ),
        ];
        match refused.into_iter().find(|(is_asked, ..)| *is_asked) {
            Some((_, option, why)) => bail!(Usage(format!("{option} in parts: {why}"))),
            None => Ok(()),
        }
    }
}

pub(crate) fn run(arguments: &PlanArgs, common: &Common, out: &mut impl Write) -> anyhow::Result<Exit> {
    let PlanArgs { asked, output: folder, cores, whole } = arguments;
    whole.check(asked)?;
    let (config, like) = asked.like_in(asked.config())?;
    let started = Runs::start(&asked.files(), &asked.reading)?;
    let maps: Vec<MapSource> = maps_of(&started.names(), &asked.maps)?.into_iter().collect();
    let _taken = OutputsFolder::take(folder)?;
    let poses = asked.settings.poses();
    let opened = OpenedRuns::open(started, maps, &asked.log, poses, config.threads, common)?;
    like.iter().try_for_each(|like| like.check_log(opened.log.summary()))?;
    let (opened, vetted) = asked.conventions.vet(opened, &asked.log, poses, &config, common)?;
    let OpenedRuns { log, runs, damaged } = opened;
    let said = vetted.as_ref().map_or_else(VetSummary::default, |vetted| vetted.summary(&option_of));
    let machine = Machine { cores: *cores as usize };
    let watch = Progress::new(common);
    let config = Config { checkpoint_every: None, resume: false, ..config };
    let plan =
        ShardPlan::new(log.as_ref(), &runs, &config, (said, damaged), machine, &watch).map_err(told)?;
    drop(watch);
    if let Some(other) = document::plan_in(folder)?.filter(|other| other.hash() != plan.hash()) {
        let folder = folder.display();
        bail!(Usage(format!("{folder}: it holds another plan, {}: name another folder", other.hash())));
    }
    document::write(folder, &plan, &runs)?;
    let exit = if plan.is_incomplete() { Exit::InputDamaged } else { Exit::Done };
    when_printed(print(out, &plan, folder), exit)
}

fn print(out: &mut impl Write, plan: &ShardPlan, folder: &std::path::Path) -> anyhow::Result<()> {
    let suggested = plan.suggested();
    let (scans, returns) = (plan.scans(), plan.returns());
    writeln!(out, "plan {}", plan.hash())?;
    writeln!(
        out,
        "{}, {}, {}",
        counted(plan.runs().len() as u64, "run"),
        counted(scans, "scan"),
        counted(returns, "return")
    )?;
    if !plan.index().is_by_scan() {
        writeln!(out, "the log has no index of its scans: every part opens all of it")?;
    }
    writeln!(out, "for {} cores, with {} MiB each at least:", suggested.cores, suggested.memory_bytes >> 20)?;
    let folder = folder.display();
    for (stage, parts) in [
        ("fuse", suggested.fuse),
        ("merge", suggested.merge),
        ("cast", suggested.cast),
        ("drift", suggested.drift),
    ] {
        writeln!(out, "  dmp shard {stage} {folder} --part I/{parts}, I from 1 to {parts}")?;
    }
    Ok(writeln!(out, "  dmp shard reduce {folder}")?)
}
