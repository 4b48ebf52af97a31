//! Runs the command on a disk that fails, and kills it at every step: what `docs/reliability.md` tells comes from here.

mod attempt;
mod bench;
mod calls;
mod crash;
mod journal;
mod one;
mod shim;
mod table;
mod verdict;

use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use clap::Args;

use crate::bench::circumstances;
use crate::trials::{self, Bounds, Found, is_named};
use attempt::Breaker;
use one::Told;
use table::Table;

/// Let operations on files fail, kill the command and lose what was not synced, and count what comes of it
#[derive(Debug, Args)]
pub(crate) struct FaultsArgs {
    /// Tries of each command
    #[arg(long, default_value_t = 450)]
    tries: u64,
    /// Another number makes other tries
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The number of the first try of each command: a failure tells its own
    #[arg(long, default_value_t = 0)]
    first: u64,
    /// Only commands whose name holds this, in any case
    #[arg(long, value_name = "COMMAND")]
    only: Vec<String>,
    /// End after so many seconds, however many tries there were
    #[arg(long, value_name = "T")]
    seconds: Option<u64>,
    /// As if nothing had ever been synced before a kill: then there must be failures, or none would be found
    #[arg(long)]
    ignore_syncs: bool,
    /// Where failures are put
    #[arg(long, value_name = "FOLDER", default_value = "target/faults")]
    keep: PathBuf,
    /// Tries at a time [one for each core]
    #[arg(long, value_name = "N")]
    jobs: Option<usize>,
    /// The command, if it is not the one beside this program
    #[arg(long, value_name = "PATH")]
    dmp: Option<PathBuf>,
}

pub(crate) fn run(arguments: &FaultsArgs) -> anyhow::Result<()> {
    let dmp = trials::command(arguments.dmp.as_deref())?;
    let mut tried = calls::calls(&dmp)?;
    tried.retain(|tried| arguments.only.is_empty() || is_named(tried.name, &arguments.only));
    anyhow::ensure!(!tried.is_empty(), "no such command");
    let stop = trials::interrupts()?;
    let breaker = Breaker::prepare(dmp, tried, (arguments.seed, arguments.ignore_syncs), stop)?;
    let commands = breaker.calls().len();
    let rows = breaker.calls().iter().enumerate().map(|(at, tried)| (tried.name, breaker.operations(at)));
    let state = Mutex::new((Table::new(rows), Found::new(&arguments.keep)));
    let one = |at: u64| -> anyhow::Result<()> {
        let (call, number) = (at as usize % commands, arguments.first + at / commands as u64);
        let Some(told) = breaker.attempt(call, number)? else { return Ok(()) };
        let mut state = state.lock().unwrap_or_else(PoisonError::into_inner);
        let (table, found) = &mut *state;
        table.count(call, &told);
        keep(found, breaker.calls()[call].name, arguments.seed, number, &told)?;
        if at % 50 == 49 {
            let (faults, kills, failed) = table.totals();
            eprint!("\r{faults} faults, {kills} kills, {failed} failures, {} that differ ", found.len());
        }
        Ok(())
    };
    let start = Instant::now();
    let tries = arguments.tries.saturating_mul(commands as u64);
    trials::work(Bounds { tries, seconds: arguments.seconds, jobs: arguments.jobs }, stop, one)?;
    eprintln!();
    let (table, found) = state.into_inner().unwrap_or_else(PoisonError::into_inner);
    let (faults, kills, failed) = table.totals();
    let taken = start.elapsed().as_secs_f64();
    println!("{faults} faults and {kills} kills in {taken:.0} s; {}\n", circumstances());
    print!("{}", table.markdown());
    anyhow::ensure!(failed == 0, "{failed} failures, {} that differ:\n{}", found.len(), found.told());
    Ok(())
}

/// Tells a failure that is new, and keeps what was done.
fn keep(found: &mut Found, command: &str, seed: u64, number: u64, told: &Told) -> anyhow::Result<()> {
    let Some(failure) = &told.failure else { return Ok(()) };
    let again = format!("cargo xtask faults --only '{command}' --seed {seed} --first {number} --tries 1");
    // Random names and numbers do not tell failures apart.
    let told_of = format!("{command}: {failure}, at {}", told.at);
    let sign: String = told_of
        .split(' ')
        .map(|word| {
            if word.contains("dmp-tmp") || word.contains("dmp-work") || word.contains('#') {
                "…"
            } else {
                word
            }
        })
        .collect::<Vec<_>>()
        .join(" ");
    let Some(folder) = found.add(sign.clone(), &again, &format!("{command}-{seed}-{number}")) else {
        return Ok(());
    };
    std::fs::create_dir_all(&folder)?;
    let text = format!("{again}\n{failure}\n{}\n{}\n", told.at, told.steps.join("\n"));
    std::fs::write(folder.join("steps.txt"), text)?;
    std::fs::write(folder.join("stdout.txt"), &told.printed)?;
    std::fs::write(folder.join("stderr.txt"), &told.said)?;
    eprintln!("\r{sign}\n    {again}");
    Ok(())
}
