//! `dmp shard plan`: decides on everything that parts must agree on.

use std::io::Write;
use std::path::Path;

use anyhow::bail;
use dmp::{Config, MapSource};
use dmp_draw::text::counted;
use dmp_shard::{Machine, ShardPlan};

use super::document::{self, in_words};
use crate::commands::score;
use crate::console::{Common, Exit, Progress, Usage, when_printed};
use crate::files::OutputsFolder;
use crate::inputs::{LogInput, OpenedRuns, Runs, vetting};
use crate::named::maps_of;
use crate::options::{Asked, Out, Spec, input, output, scoring, tools};

/// Why parts do not write what is made of single returns.
const RETURNS: &str = "it needs single returns, which no part keeps: use `dmp score`";
const AGAIN: &str = "a part that is not done is run again";

pub(super) static SPEC: Spec = Spec {
    name: "plan",
    about: "Plan a score in parts: which scans lie where in the log, which returns are used, voxels and segments",
    more: "Reads the log once, as `dmp score` does before it fuses, and writes plan.json and the runs to a folder for the files \
           of all parts. Reports what part of the log is damaged.",
    usage: "dmp shard plan [OPTIONS] LOG -t [NAME=]RUN.tum [-t [NAME=]RUN2.tum ...] -o FOLDER",
    after: "Examples:\n  \
            dmp shard plan drive.mcap -t runs/*.tum -o work\n  \
            dmp shard plan city.mcap -t a.tum -t b.tum -o work --cores 256\n\n\
            Exit codes: 0 done; 1 failed; 2 wrong usage; 3 done, but part of the log was lost or damaged, or a run was \
            excluded.",
    options: &[
        input::RUNS_ON_LOG,
        scoring::MAPPING,
        scoring::EVALUATION,
        input::CHECKS,
        scoring::MEANS,
        &[&tools::PLAN_FOLDER, &tools::CORES],
    ],
    refused: &[
        (&output::REPORT, RETURNS),
        (&output::SCENE, RETURNS),
        (&output::KEEP, RETURNS),
        (&output::RESIDUALS, RETURNS),
        (&output::PER_FRAME, RETURNS),
        (&output::PER_TILE, RETURNS),
        (&scoring::RESUME, AGAIN),
        (&scoring::QUICK, "it reads a small part of the log: use `dmp score`"),
    ],
    run,
    ..Spec::EMPTY
};

fn run(asked: &Asked, common: &Common, out: &mut Out<'_>) -> anyhow::Result<Exit> {
    if let Some((option, why)) = asked.refused() {
        bail!(Usage(format!("--{option} in parts: {why}")));
    }
    let config = score::config(asked)?;
    let folder = asked.need(&tools::PLAN_FOLDER)?;
    let started = Runs::start_some(asked)?;
    let maps: Vec<MapSource> = maps_of(&started.names(), &asked.all(&input::MAPS))?;
    let _taken = OutputsFolder::take(&folder)?;
    let log = LogInput::of(asked)?;
    let opened = OpenedRuns::open(started, maps, &log, asked, config.threads, common)?;
    let (opened, vetted) = vetting::checked(opened, &log, asked, &config, common)?;
    let OpenedRuns { log, runs, unread, damaged, .. } = opened;
    let said = vetting::summary(vetted.as_ref(), &unread);
    let machine = Machine { cores: asked.get(&tools::CORES).unwrap_or(8) as usize };
    let watch = Progress::new(common);
    let config = Config { checkpoint_every: None, resume: false, ..config };
    let plan =
        ShardPlan::new(log.as_ref(), &runs, &config, (said, damaged), machine, &watch).map_err(in_words)?;
    drop(watch);
    if let Some(other) = document::plan_in(&folder)?.filter(|other| other.hash() != plan.hash()) {
        let folder = folder.display();
        bail!(Usage(format!("{folder}: it holds another plan, {}: name another folder", other.hash())));
    }
    document::write(&folder, &plan, &runs)?;
    let exit = if plan.is_incomplete() { Exit::InputDamaged } else { Exit::Done };
    when_printed(print(out, &plan, &folder), exit)
}

fn print(out: &mut impl Write, plan: &ShardPlan, folder: &Path) -> anyhow::Result<()> {
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
