//! Attacks the command with damaged files of every kind: the numbers of `docs/reliability.md` come from here.

mod attempt;
mod seeds;
mod verdict;

use clap::Args;

use crate::trials::{self, Table, TryArgs, is_named};
use attempt::Attacker;

/// Damage small files of every kind, run the command on them, and count the outcomes
#[derive(Debug, Args)]
pub(crate) struct AttackArgs {
    /// Tries of each kind of input
    #[arg(long, default_value_t = 200)]
    tries: u64,
    /// No kinds of input whose name contains this
    #[arg(long, value_name = "KIND")]
    without: Vec<String>,
    #[command(flatten)]
    trials: TryArgs,
}

pub(crate) fn run(arguments: &AttackArgs) -> anyhow::Result<()> {
    let trials = &arguments.trials;
    let dmp = trials.command()?;
    let wants = |kind: &str| trials.wants(kind) && !is_named(kind, &arguments.without);
    let kinds = seeds::kinds(&dmp, wants)?;
    anyhow::ensure!(!kinds.is_empty(), "no such kind of input");
    let stop = trials::interrupts()?;
    let attacker = Attacker::prepare(dmp, kinds, trials.seed, stop)?;
    let table = Table::new("input | command | tries | accepted | refused");
    let one = |kind, number| attacker.attempt(kind, number);
    trials::drive("attack", trials, arguments.tries, (attacker.kinds(), table), stop, one)
}
