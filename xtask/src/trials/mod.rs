//! What tries have in common that do things to the command thousands of times: attacks and faults.

mod files;
mod found;
mod random;
mod run;
mod seed;
mod shop;

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use anyhow::Context as _;

pub(crate) use files::{folder, paths, write};
pub(crate) use found::Found;
pub(crate) use random::Random;
pub(crate) use run::{End, Ended, TOO_LONG_A_FILE, run};
pub(crate) use seed::{Call, File, Form, Kind, Seed, seed};
pub(crate) use shop::Shop;

/// The command to try: the one that is named, or the one beside this program.
pub(crate) fn command(named: Option<&Path>) -> anyhow::Result<PathBuf> {
    let dmp = match named {
        Some(path) => path.to_owned(),
        None => std::env::current_exe()?.with_file_name("dmp"),
    };
    dmp.canonicalize().with_context(|| format!("no {}: cargo build --release -p dmp-cli", dmp.display()))
}

/// Whether a name holds one of some parts, in any case.
pub(crate) fn is_named(name: &str, parts: &[String]) -> bool {
    parts.iter().any(|part| name.to_lowercase().contains(&part.to_lowercase()))
}

/// Set once somebody wants the end: no further try begins, and the folders of those that run are removed.
pub(crate) fn interrupts() -> anyhow::Result<&'static AtomicBool> {
    static STOP: AtomicBool = AtomicBool::new(false);
    ctrlc::set_handler(|| STOP.store(true, Ordering::Relaxed))?;
    Ok(&STOP)
}

/// How many tries there are, for how long, how many at a time.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bounds {
    pub(crate) tries: u64,
    /// Instead of so many tries.
    pub(crate) seconds: Option<u64>,
    pub(crate) jobs: Option<usize>,
}

/// Does the tries 0, 1, 2, … on several threads.
pub(crate) fn work(
    bounds: Bounds,
    stop: &AtomicBool,
    one: impl Fn(u64) -> anyhow::Result<()> + Sync,
) -> anyhow::Result<()> {
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let jobs = bounds.jobs.unwrap_or(cores).max(1);
    let deadline = bounds.seconds.map(|seconds| Instant::now() + Duration::from_secs(seconds));
    let next = AtomicU64::new(0);
    let is_over =
        || stop.load(Ordering::Relaxed) || deadline.is_some_and(|deadline| Instant::now() >= deadline);
    let worker = || -> anyhow::Result<()> {
        loop {
            let at = next.fetch_add(1, Ordering::Relaxed);
            if is_over() || at >= bounds.tries && deadline.is_none() {
                return Ok(());
            }
            one(at)?;
        }
    };
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..jobs).map(|_| scope.spawn(worker)).collect();
        workers.into_iter().try_for_each(|worker| {
            worker.join().unwrap_or_else(|_| Err(anyhow::anyhow!("a thread that tries panicked")))
        })
    })
}
