//! Attacks the command with damaged files of every kind: what `docs/reliability.md` tells comes from here.

mod attempt;
mod found;
mod mcap;
mod mutate;
mod seeds;
mod table;
mod verdict;

use std::path::PathBuf;
use std::sync::atomic::AtomicBool;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use clap::Args;

use crate::bench::circumstances;
use crate::trials::{self, Bounds, Found, is_named};
use attempt::{Attacker, Attempt};
use table::Table;

/// Damage small files of every kind, run the command on them, and count what it does
#[derive(Debug, Args)]
pub(crate) struct AttackArgs {
    /// Tries of each kind of input
    #[arg(long, default_value_t = 200)]
    tries: u64,
    /// Another number makes other tries
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The number of the first try of each kind: a failure tells its own
    #[arg(long, default_value_t = 0)]
    first: u64,
    /// Only kinds of input whose name holds this, in any case
    #[arg(long, value_name = "KIND")]
    only: Vec<String>,
    /// No kinds of input whose name holds this
    #[arg(long, value_name = "KIND")]
    without: Vec<String>,
    /// End after so many seconds, however many tries there were
    #[arg(long, value_name = "T")]
    seconds: Option<u64>,
    /// Where the files of failures are put
    #[arg(long, value_name = "FOLDER", default_value = "target/attack")]
    keep: PathBuf,
    /// Tries at a time [one for each core]
    #[arg(long, value_name = "N")]
    jobs: Option<usize>,
    /// The command, if it is not the one beside this program
    #[arg(long, value_name = "PATH")]
    dmp: Option<PathBuf>,
}

pub(crate) fn run(arguments: &AttackArgs) -> anyhow::Result<()> {
    let dmp = trials::command(arguments.dmp.as_deref())?;
    let mut kinds = seeds::kinds(&dmp)?;
    kinds.retain(|kind| arguments.only.is_empty() || is_named(kind.name, &arguments.only));
    kinds.retain(|kind| !is_named(kind.name, &arguments.without));
    anyhow::ensure!(!kinds.is_empty(), "no such kind of input");
    let stop = trials::interrupts()?;
    let attacker = Attacker::prepare(dmp, kinds, arguments.seed, stop)?;
    let start = Instant::now();
    let (table, found) = work(&attacker, arguments, stop)?;
    let (tries, failed) = table.totals();
    println!("{tries} tries in {:.0} s; {}\n", start.elapsed().as_secs_f64(), circumstances());
    print!("{}", table.markdown());
    anyhow::ensure!(failed == 0, "{failed} failures, {} that differ:\n{}", found.len(), found.told());
    Ok(())
}

/// All tries, on several threads.
fn work(attacker: &Attacker, arguments: &AttackArgs, stop: &AtomicBool) -> anyhow::Result<(Table, Found)> {
    let kinds = attacker.kinds() as u64;
    let state = Mutex::new((Table::default(), Found::new(&arguments.keep)));
    let one = |at: u64| -> anyhow::Result<()> {
        let attempt = Attempt { kind: (at % kinds) as usize, number: arguments.first + at / kinds };
        let Some(outcome) = attacker.attempt(attempt)? else { return Ok(()) };
        let mut state = state.lock().unwrap_or_else(PoisonError::into_inner);
        let (table, found) = &mut *state;
        table.count(outcome.kind, &outcome.command, &outcome.verdict);
        found::add(found, &outcome)?;
        if at % 100 == 99 {
            let (tries, failed) = table.totals();
            eprint!("\r{tries} tries, {failed} failures, {} that differ ", found.len());
        }
        Ok(())
    };
    let tries = arguments.tries.saturating_mul(kinds);
    trials::work(Bounds { tries, seconds: arguments.seconds, jobs: arguments.jobs }, stop, one)?;
    eprintln!();
    Ok(state.into_inner().unwrap_or_else(PoisonError::into_inner))
}
