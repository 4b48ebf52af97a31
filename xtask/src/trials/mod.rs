//! What attacks and faults have in common: tries that do something to the command, thousands of times.

#[path = "../../../fuzz/damage/mod.rs"]
#[allow(dead_code, reason = "the tests of dmp-log and the fuzz target use more of it")]
pub(crate) mod damage;
mod files;
mod run;
mod seed;
mod shop;
mod table;

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use anyhow::Context as _;
use clap::Args;

pub(crate) use damage::{Form, Random};
pub(crate) use files::{folder, paths, write};
pub(crate) use run::{End, Ended, TOO_LONG_A_FILE, run};
pub(crate) use seed::{Call, File};
pub(crate) use shop::Shop;
pub(crate) use table::{Failure, Outcome, Table};

use crate::bench::circumstances;

/// Which tries there are.
#[derive(Debug, Args)]
pub(crate) struct TryArgs {
    /// Another number makes other tries
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// The number of the first try of each row: a failure prints its own
    #[arg(long, default_value_t = 0)]
    first: u64,
    /// Only rows whose name contains this, in any case
    #[arg(long, value_name = "NAME")]
    only: Vec<String>,
    /// End after so many seconds, however many tries there were
    #[arg(long, value_name = "T")]
    seconds: Option<u64>,
    /// Where failures are kept [target/attack or target/faults]
    #[arg(long, value_name = "FOLDER")]
    keep: Option<PathBuf>,
    /// Tries at a time [one for each core]
    #[arg(long, value_name = "N")]
    jobs: Option<usize>,
    /// The command, if it is not the one beside this program
    #[arg(long, value_name = "PATH")]
    dmp: Option<PathBuf>,
}

impl TryArgs {
    /// The command to try.
    pub(crate) fn command(&self) -> anyhow::Result<PathBuf> {
        command(self.dmp.as_deref())
    }

    /// Whether a row is to be tried.
    pub(crate) fn wants(&self, name: &str) -> bool {
        self.only.is_empty() || is_named(name, &self.only)
    }
}

/// The command: the one that is named, or the one beside this program.
pub(crate) fn command(named: Option<&Path>) -> anyhow::Result<PathBuf> {
    let dmp = match named {
        Some(path) => path.to_owned(),
        None => std::env::current_exe()?.with_file_name("dmp"),
    };
    dmp.canonicalize().with_context(|| format!("no {}: cargo build --release -p dmp-cli", dmp.display()))
}

/// Whether a name contains one of some parts, in any case.
pub(crate) fn is_named(name: &str, parts: &[String]) -> bool {
    parts.iter().any(|part| name.to_lowercase().contains(&part.to_lowercase()))
}

/// Set once somebody wants the end: no further try begins, and the folders of those that run are removed.
pub(crate) fn interrupts() -> anyhow::Result<&'static AtomicBool> {
    static STOP: AtomicBool = AtomicBool::new(false);
    ctrlc::set_handler(|| STOP.store(true, Ordering::Relaxed))?;
    Ok(&STOP)
}

/// The numbers of a try: which rows there are beside it does not matter.
pub(crate) fn numbers(seed: u64, row: &str, number: u64) -> Random {
    let row = row.bytes().fold(0_u64, |hash, byte| hash.wrapping_mul(257) + u64::from(byte));
    Random::of(&[seed, row, number])
}

/// Does the tries of every row in turn, on several threads, prints the table, and keeps what failed. `task` is `attack` or
/// `faults`. `one` gives nothing where it was interrupted.
pub(crate) fn drive(
    task: &str,
    arguments: &TryArgs,
    tries: u64,
    (rows, mut table): (usize, Table),
    stop: &AtomicBool,
    one: impl Fn(usize, u64) -> anyhow::Result<Option<Outcome>> + Sync,
) -> anyhow::Result<()> {
    let keep = arguments.keep.clone().unwrap_or_else(|| Path::new("target").join(task));
    table.keep_failures(&keep);
    let (start, table, next) = (Instant::now(), Mutex::new(table), AtomicU64::new(0));
    let tries = tries.saturating_mul(rows as u64);
    let deadline = arguments.seconds.map(|seconds| start + Duration::from_secs(seconds));
    let is_over =
        || stop.load(Ordering::Relaxed) || deadline.is_some_and(|deadline| Instant::now() >= deadline);
    let worker = || -> anyhow::Result<()> {
        loop {
            let at = next.fetch_add(1, Ordering::Relaxed);
            if is_over() || at >= tries && deadline.is_none() {
                return Ok(());
            }
            let (row, number) = (at as usize % rows, arguments.first + at / rows as u64);
            let Some(outcome) = one(row, number)? else { continue };
            let mut table = table.lock().unwrap_or_else(PoisonError::into_inner);
            table.add(&outcome)?;
            if at % 100 == 99 {
                eprint!("\r{} tries, {} failures ", table.tries(), table.failures());
            }
        }
    };
    let jobs = arguments.jobs.unwrap_or(std::thread::available_parallelism().map_or(1, usize::from)).max(1);
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..jobs).map(|_| scope.spawn(worker)).collect();
        workers.into_iter().try_for_each(|worker| {
            worker.join().unwrap_or_else(|_| Err(anyhow::anyhow!("a thread that tries panicked")))
        })
    })?;
    let table = table.into_inner().unwrap_or_else(PoisonError::into_inner);
    println!("\n{} tries in {:.0} s; {}\n", table.tries(), start.elapsed().as_secs_f64(), circumstances());
    print!("{}", table.markdown());
    anyhow::ensure!(table.failures() == 0, "{} failures:\n{}", table.failures(), table.found());
    Ok(())
}
