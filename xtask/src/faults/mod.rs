//! Runs the command on a disk that fails, and kills it at every step: the numbers of `docs/reliability.md` come from here.

mod attempt;
mod bench;
mod calls;
mod crash;
mod journal;
mod one;
mod shim;
mod verdict;

use clap::Args;

use crate::trials::{self, Table, TryArgs};
use attempt::Breaker;

/// Make operations on files fail, kill the command and lose what was not synced, and count the outcomes
#[derive(Debug, Args)]
pub(crate) struct FaultsArgs {
    /// Tries of each command
    #[arg(long, default_value_t = 450)]
    tries: u64,
    /// As if nothing had ever been synced before a kill: then there must be failures, or none would be found
    #[arg(long)]
    ignore_syncs: bool,
    #[command(flatten)]
    trials: TryArgs,
}

pub(crate) fn run(arguments: &FaultsArgs) -> anyhow::Result<()> {
    let trials = &arguments.trials;
    let dmp = trials.command()?;
    let calls = calls::calls(&dmp, |name| trials.wants(name))?;
    anyhow::ensure!(!calls.is_empty(), "no such command");
    let stop = trials::interrupts()?;
    let breaker = Breaker::prepare(dmp, calls, (trials.seed, arguments.ignore_syncs), stop)?;
    let mut table = Table::new("command | operations | faults | kills | same bits | refused");
    breaker.operations().for_each(|(row, operations)| table.count(&row, &[operations, 0, 0, 0, 0], None));
    let one = |call, number| breaker.attempt(call, number);
    trials::drive("faults", trials, arguments.tries, (breaker.calls(), table), stop, one)
}
