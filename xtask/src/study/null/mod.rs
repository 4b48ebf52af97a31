//! `cargo xtask study null`: whether verdicts call equal runs equal, and still order different ones.

mod drift;
mod logs;
mod sets;
mod sums;
mod tally;

use std::path::PathBuf;

use anyhow::Context as _;
use dmp::{Config, Run};
use dmp_sensor::Trajectory;

use logs::{NullLog, names};
use sets::{Set, sets};
use tally::{Counts, Verdicts};

/// Score equal runs, on which no verdict may decide, and runs of known order
#[derive(Debug, clap::Args)]
pub(super) struct NullArgs {
    /// Only these logs, comma-separated [default: all]
    #[arg(long, value_delimiter = ',')]
    logs: Vec<String>,
    /// Draws of each kind of noise; every two of them are equal
    #[arg(long, default_value_t = 6)]
    draws: u64,
    /// Score only every so many scans
    #[arg(long, value_name = "N", default_value_t = 1)]
    every: usize,
    /// Compare the runs by drift instead of scores
    #[arg(long)]
    drift: bool,
    /// Folder for the logs
    #[arg(long, default_value = "target/study", value_name = "FOLDER")]
    out: PathBuf,
}

pub(super) fn run(arguments: &NullArgs) -> anyhow::Result<()> {
    std::fs::create_dir_all(&arguments.out).with_context(|| arguments.out.display().to_string())?;
    let (mut verdicts, mut of_drift) = (Verdicts::default(), drift::OfSets::new());
    for name in names(&arguments.logs)? {
        let Some(log) = NullLog::open(&name, &arguments.out)? else { continue };
        if arguments.drift {
            for set in sets(&log, arguments.draws)? {
                *of_drift.entry((set.kind, set.name.clone())).or_default() += drift::count(&log, &set)?;
            }
            continue;
        }
        for set in sets(&log, arguments.draws)? {
            let counts = score(&log, &set, arguments.every)?;
            counts.print(&name, &set.name);
            verdicts.add(&set, counts);
        }
    }
    if arguments.drift {
        drift::print(&of_drift);
    } else {
        verdicts.print();
    }
    Ok(())
}

/// Scores the runs of a set in one command.
fn score(log: &NullLog, set: &Set, every: usize) -> anyhow::Result<Counts> {
    let named = |(name, trajectory): &(String, Trajectory)| Run::new(name, trajectory.clone());
    let runs: Vec<Run> = set.runs.iter().map(named).collect();
    let sums = sums::Sums::new(log.log.frames().len(), runs.len(), log.scales);
    let config = Config { every, ..Config::default() };
    let report = dmp::evaluate(log.log.as_ref(), &runs, &config, dmp::Watch::sink(&sums))
        .with_context(|| format!("{} of {}", set.name, log.name))?;
    Ok(Counts::of(set, &sums.finish(), &report))
}
