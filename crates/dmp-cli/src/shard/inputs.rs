//! `dmp shard inputs`: what a part reads, for who brings it there.

use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use clap::builder::PossibleValuesParser;
use dmp::{Config, Part, Shard, ShardStage};

use super::document::{OpenedPlan, told};
use super::part::PlannedLogArgs;
use crate::common::Common;
use crate::exit::Exit;
use crate::settings::ResourceArgs;

/// Print as JSON what a part reads: of which files which bytes
///
/// For schedulers that bring files to where parts are done. `log` has the files of the log (`null`: all of it), `files` those of
/// the plan's folder, beside plan.json and *.part, which parts read in any case and which must be there already. Bytes that are not
/// named are never looked at: a file of the same length with holes will do.
#[derive(Debug, Args)]
pub(crate) struct InputsArgs {
    /// The folder of a plan, or its plan.json
    #[arg(value_name = "PLAN")]
    plan: PathBuf,
    /// The stage: fuse, merge, cast or drift
    #[arg(value_name = "STAGE", value_parser = PossibleValuesParser::new(ShardStage::ALL.map(ShardStage::name)))]
    stage: String,
    /// Which part: `3/8` is the third of eight
    #[arg(long, value_name = "I/N", value_parser = str::parse::<Part>)]
    part: Part,
    #[command(flatten)]
    log: PlannedLogArgs,
    #[command(flatten)]
    resources: ResourceArgs,
}

pub(crate) fn run(arguments: &InputsArgs, _: &Common, out: &mut impl Write) -> anyhow::Result<Exit> {
    let opened = OpenedPlan::read(&arguments.plan)?;
    let log = opened.unopened_log(arguments.log.log.as_deref())?;
    let means = Shard::means(&arguments.resources.in_config(Config::default()));
    let OpenedPlan { folder, plan, runs } = &opened;
    let shard = Shard::new(plan, runs, log.as_ref(), folder, &means, ());
    let stage = ShardStage::ALL.into_iter().find(|stage| stage.name() == arguments.stage);
    let needs = shard.needs(stage.unwrap_or(ShardStage::Fuse), arguments.part).map_err(told)?;
    serde_json::to_writer(&mut *out, &needs).map_err(std::io::Error::from)?;
    writeln!(out)?;
    Ok(Exit::Done)
}
