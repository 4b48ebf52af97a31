//! Attacks the command with damaged files of every kind: what `docs/reliability.md` tells comes from here.

mod attempt;
mod found;
mod mcap;
mod mutate;
mod random;
mod run;
mod seed;
mod seeds;
mod table;
mod verdict;

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use anyhow::Context as _;
use clap::Args;

use crate::bench::circumstances;
use attempt::{Attacker, Attempt};
use found::Found;
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
    let dmp = match &arguments.dmp {
        Some(path) => path.clone(),
        None => std::env::current_exe()?.with_file_name("dmp"),
    };
    let dmp = dmp
        .canonicalize()
        .with_context(|| format!("no {}: cargo build --release -p dmp-cli", dmp.display()))?;
    let mut kinds = seeds::kinds(&dmp)?;
    let named = |name: &str, parts: &[String]| {
        parts.iter().any(|part| name.to_lowercase().contains(&part.to_lowercase()))
    };
    kinds.retain(|kind| arguments.only.is_empty() || named(kind.name, &arguments.only));
    kinds.retain(|kind| !named(kind.name, &arguments.without));
    anyhow::ensure!(!kinds.is_empty(), "no such kind of input");
    let stop = interrupts()?;
    let attacker = Attacker::prepare(dmp, kinds, arguments.seed, stop)?;
    let start = Instant::now();
    let (table, found) = work(&attacker, arguments, stop)?;
    let (tries, failed) = table.totals();
    println!("{tries} tries in {:.0} s; {}\n", start.elapsed().as_secs_f64(), circumstances());
    print!("{}", table.markdown());
    anyhow::ensure!(failed == 0, "{failed} failures, {} that differ:\n{}", found.len(), found.told());
    Ok(())
}

/// Set once somebody wants the end: no further try begins, and the folders of those that run are removed.
fn interrupts() -> anyhow::Result<&'static AtomicBool> {
    static STOP: AtomicBool = AtomicBool::new(false);
    ctrlc::set_handler(|| STOP.store(true, Ordering::Relaxed))?;
    Ok(&STOP)
}

/// All tries, on several threads.
fn work(attacker: &Attacker, arguments: &AttackArgs, stop: &AtomicBool) -> anyhow::Result<(Table, Found)> {
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let jobs = arguments.jobs.unwrap_or(cores).max(1);
    let kinds = attacker.kinds() as u64;
    let end = arguments.tries.saturating_mul(kinds);
    let deadline = arguments.seconds.map(|seconds| Instant::now() + Duration::from_secs(seconds));
    let next = AtomicU64::new(0);
    let state = Mutex::new((Table::default(), Found::new(&arguments.keep)));
    let one = |at: u64| -> anyhow::Result<()> {
        let attempt = Attempt { kind: (at % kinds) as usize, number: arguments.first + at / kinds };
        let Some(outcome) = attacker.attempt(attempt)? else { return Ok(()) };
        let mut state = state.lock().unwrap_or_else(PoisonError::into_inner);
        let (table, found) = &mut *state;
        table.count(outcome.kind, &outcome.command, &outcome.verdict);
        found.add(&outcome)?;
        if at % 100 == 99 {
            let (tries, failed) = table.totals();
            eprint!("\r{tries} tries, {failed} failures, {} that differ ", found.len());
        }
        Ok(())
    };
    let is_over =
        || stop.load(Ordering::Relaxed) || deadline.is_some_and(|deadline| Instant::now() >= deadline);
    let worker = || -> anyhow::Result<()> {
        loop {
            let at = next.fetch_add(1, Ordering::Relaxed);
            if is_over() || at >= end && deadline.is_none() {
                return Ok(());
            }
            one(at)?;
        }
    };
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..jobs).map(|_| scope.spawn(worker)).collect();
        workers.into_iter().try_for_each(|worker| {
            worker.join().unwrap_or_else(|_| Err(anyhow::anyhow!("a thread of the attack panicked")))
        })
    })?;
    eprintln!();
    Ok(state.into_inner().unwrap_or_else(PoisonError::into_inner))
}
