//! `dmp shard fuse`, `merge`, `cast`, `drift`: a part of a stage.

use std::path::PathBuf;

use clap::Args;
use dmp::{Config, Part, Shard, ShardStage};

use super::document::{OpenedPlan, told};
use crate::common::Common;
use crate::exit::Exit;
use crate::log_args::in_threads;
use crate::progress::Progress;
use crate::say::say;
use crate::settings::ResourceArgs;

/// A part of a stage.
#[derive(Debug, Args)]
#[command(
    after_help = "Exit codes: 0 done; 1 failed, also where a part before is missing, damaged or of another plan; 2 wrong usage."
)]
pub(crate) struct PartArgs {
    /// The folder of a plan, or its plan.json
    #[arg(value_name = "PLAN")]
    plan: PathBuf,
    /// Which part: `3/8` is the third of eight
    #[arg(long, value_name = "I/N", value_parser = str::parse::<Part>)]
    part: Part,
    #[command(flatten)]
    log: PlannedLogArgs,
    #[command(flatten)]
    resources: ResourceArgs,
}

/// Where the log of a plan is.
#[derive(Debug, Args)]
pub(super) struct PlannedLogArgs {
    /// Where the log lies now, if not where it was planned
    #[arg(long, value_name = "LOG", help_heading = "Input")]
    pub(super) log: Option<PathBuf>,
}

impl PartArgs {
    pub(crate) fn run(&self, stage: ShardStage, common: &Common) -> anyhow::Result<Exit> {
        let opened = OpenedPlan::read(&self.plan)?;
        let config = self.resources.in_config(Config::default());
        let log = match stage {
            ShardStage::Merge => opened.unopened_log(self.log.log.as_deref())?,
            _ => in_threads(config.threads, || opened.open_log(self.log.log.as_deref()))??,
        };
        let means = Shard::means(&config);
        let watch = Progress::new(common);
        let OpenedPlan { folder, plan, runs } = &opened;
        let shard = Shard::new(plan, runs, log.as_ref(), folder, &means, &watch);
        let done = match stage {
            ShardStage::Fuse => shard.fuse(self.part),
            ShardStage::Merge => shard.merge(self.part),
            ShardStage::Cast => shard.cast(self.part),
            _ => shard.drift(self.part),
        };
        done.map_err(told)?;
        drop(watch);
        if let (false, Some(bytes)) = (common.quiet, log.bytes_read().filter(|&bytes| bytes > 0)) {
            let (part, all) = (self.part, log.summary().bytes);
            say!(common.host, "{stage} {part} is done: {bytes} of the log's {all} bytes were read");
        }
        Ok(Exit::Done)
    }
}
