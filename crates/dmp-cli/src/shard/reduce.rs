//! `dmp shard reduce`: what all parts came to, as `dmp score` tells it.

use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use dmp::{Config, Shard};

use super::document::{OpenedPlan, told};
use super::part::PlannedLogArgs;
use crate::common::Common;
use crate::exit::{Exit, when_printed};
use crate::gates::GateArgs;
use crate::progress::Progress;
use crate::score::{announce, print};
use crate::settings::ResourceArgs;

/// Add up what all parts came to, and print it as `dmp score` does
///
/// The scores are those of `dmp score` to the bit; `timing` and `memory` are those of this command. A part that is missing, damaged
/// or of another plan is named, and so is a scan that is in no part or in two.
#[derive(Debug, Args)]
#[command(
    after_help = "Exit codes: 0 done; 1 failed; 2 wrong usage; 3 done, but part of the log was lost or damaged, or a run was left out; 4 done, \
    but a gate failed, whether part of the log was lost or not."
)]
pub(crate) struct ReduceArgs {
    /// The folder of a plan, or its plan.json
    #[arg(value_name = "PLAN")]
    plan: PathBuf,
    #[command(flatten)]
    log: PlannedLogArgs,
    #[command(flatten)]
    resources: ResourceArgs,
    /// Print one JSON object (schema dmp-score/2) instead of tables
    #[arg(long, help_heading = "Output")]
    json: bool,
    /// Also print every scale of every pair, all scores, where returns went, times and memory
    #[arg(short, long, conflicts_with = "json", help_heading = "Output")]
    verbose: bool,
    #[command(flatten)]
    gates: GateArgs,
}

pub(crate) fn run(arguments: &ReduceArgs, common: &Common, out: &mut impl Write) -> anyhow::Result<Exit> {
    let opened = OpenedPlan::read(&arguments.plan)?;
    let gates = arguments.gates.start(&opened.plan.names())?;
    let log = opened.unopened_log(arguments.log.log.as_deref())?;
    let means = Shard::means(&arguments.resources.in_config(Config::default()));
    let OpenedPlan { folder, plan, runs } = &opened;
    let watch = Progress::new(common);
    let report = Shard::new(plan, runs, log.as_ref(), folder, &means, &watch).reduce().map_err(told)?;
    drop(watch);
    let checked = gates.check(&report);
    let exit = if plan.is_incomplete() { Exit::InputDamaged } else { Exit::Done };
    let exit = gates.end(&common.host, &report, &checked, exit)?;
    let printed = print(out, &report, &checked, (arguments.json, arguments.verbose), common.terminal);
    if !common.quiet {
        announce::done(&common.host, &report);
    }
    when_printed(printed, exit)
}
