//! `dmp shard`: a score in parts, for any scheduler.

mod document;
mod inputs;
mod part;
mod plan;
mod reduce;

use clap::Subcommand;

use crate::common::Common;
use crate::exit::Exit;

/// Score in parts, on as many machines as there are: plan, fuse, merge, cast, drift, reduce
///
/// `plan` decides on everything that does not depend on who does what, and writes it to a folder. Every part of a stage is a
/// command that reads files and writes files there; parts of a stage may be done at the same time and in any order, and again:
/// they write the same bytes. All parts of a stage must be done before the next stage; `drift` needs no other. `reduce` gives the
/// scores of `dmp score`, to the bit.
#[derive(Debug, Subcommand)]
#[command(after_help = "Example, on one machine:\n  \
    dmp shard plan drive.mcap -t a.tum -t b.tum -o work\n  \
    for i in 1 2 3 4; do dmp shard fuse work --part $i/4; done\n  \
    dmp shard merge work --part 1/1\n  \
    for i in 1 2 3 4; do dmp shard cast work --part $i/4; done\n  \
    dmp shard drift work --part 1/1\n  \
    dmp shard reduce work")]
pub(crate) enum Shard {
    Plan(Box<plan::PlanArgs>),
    /// Fuse some scans into sums of voxels, with the poses of every run
    Fuse(part::PartArgs),
    /// Make surfels of the sums of some tiles; all parts must be fused
    Merge(part::PartArgs),
    /// Cast some scans into the maps; all parts must be merged
    Cast(part::PartArgs),
    /// Bring some visits to the same places onto each other, to measure drift
    Drift(part::PartArgs),
    Reduce(reduce::ReduceArgs),
    Inputs(inputs::InputsArgs),
}

impl Shard {
    pub(crate) fn run(&self, common: &Common, out: &mut impl std::io::Write) -> anyhow::Result<Exit> {
        match self {
            Self::Plan(arguments) => plan::run(arguments, common, out),
            Self::Fuse(arguments) => arguments.run(dmp::ShardStage::Fuse, common),
            Self::Merge(arguments) => arguments.run(dmp::ShardStage::Merge, common),
            Self::Cast(arguments) => arguments.run(dmp::ShardStage::Cast, common),
            Self::Drift(arguments) => arguments.run(dmp::ShardStage::Drift, common),
            Self::Reduce(arguments) => reduce::run(arguments, common, out),
            Self::Inputs(arguments) => inputs::run(arguments, common, out),
        }
    }
}
