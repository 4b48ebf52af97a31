//! `cargo xtask study null`: are equal maps called equal, and different ones still told apart?

mod drift;
mod halves;
mod logs;
mod sets;
mod sums;
mod tally;

use std::path::PathBuf;

use anyhow::Context as _;
use dmp::{Config, Run};
use dmp_sensor::Trajectory;

use halves::halves;
use logs::{NullLog, names};
use sets::{Set, sets};
use tally::{Counts, Verdicts};

/// Equal runs, which no command may tell apart, and runs of known order beside them
#[derive(Debug, clap::Args)]
pub(super) struct NullArgs {
    /// Only these logs, comma-separated; all of them by default
    #[arg(long, value_delimiter = ',')]
    logs: Vec<String>,
    /// Draws of each kind of noise; every two of them are equal
    #[arg(long, default_value_t = 6)]
    draws: u64,
    /// Also move the grid of the voxels so many times, to see how much of an interval that is
    #[arg(long, default_value_t = 0, value_name = "N")]
    grids: u64,
    /// Only measure drift, and tell what that says of them
    #[arg(long)]
    drift: bool,
    /// Where logs are kept
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
                *of_drift.entry((set.kind, set.name.clone())).or_default() += drift::told(&log, &set)?;
            }
            continue;
        }
        for set in sets(&log, arguments.draws)? {
            let counts = score(&log, &set)?;
            counts.print(&name, &set.name);
            verdicts.add(&set, counts);
        }
        halves(&log)?.print(&name);
        if arguments.grids > 0 {
            sets::grids(&log, arguments.grids)?.print(&name);
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
fn score(log: &NullLog, set: &Set) -> anyhow::Result<Counts> {
    let named = |(name, trajectory): &(String, Trajectory)| Run::new(name, trajectory.clone());
    let runs: Vec<Run> = set.runs.iter().map(named).collect();
    let sums = sums::Sums::new(log.log.frames().len(), runs.len(), log.scales);
    let report = dmp::evaluate(log.log.as_ref(), &runs, &Config::default(), dmp::Watch::sink(&sums))
        .with_context(|| format!("{} of {}", set.name, log.name))?;
    Ok(Counts::of(set, &sums.finish(), &report))
}
