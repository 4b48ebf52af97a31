//! `cargo xtask bench score`: how fast a whole `dmp score` is.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::Context as _;
use clap::Args;
use serde::Deserialize;

use super::taken::{Taken, taken_by};
use super::times::{circumstances, spread};

/// Measure a whole `dmp score`: points per second of processor time, and how busy the cores are
#[derive(Debug, Args)]
pub(crate) struct ScoreArgs {
    /// The log
    log: PathBuf,
    /// A run; may be given several times
    #[arg(long, required = true)]
    trajectory: Vec<PathBuf>,
    /// Numbers of threads, comma-separated
    #[arg(long, value_delimiter = ',', default_values_t = [1, 2])]
    threads: Vec<u32>,
    /// Runs of each, interleaved
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..))]
    runs: u32,
    /// The command, built in release. Given several times, the others are compared with the first
    #[arg(long, default_value = "target/release/dmp")]
    dmp: Vec<PathBuf>,
}

/// What is used of the command's JSON.
#[derive(Debug, Deserialize)]
struct Report {
    inputs: Inputs,
    timing: Timing,
}

#[derive(Debug, Deserialize)]
struct Inputs {
    returns: u64,
}

#[derive(Debug, Deserialize)]
#[expect(clippy::struct_field_names, reason = "as the command names them: seconds")]
struct Timing {
    plan_s: f64,
    fuse_s: f64,
    cast_s: f64,
    total_s: f64,
}

type Measured = (Taken, Report);

/// A command with a number of threads.
struct Case<'a> {
    dmp: &'a Path,
    threads: u32,
    measured: Vec<Measured>,
}

pub(crate) fn run(arguments: &ScoreArgs) -> anyhow::Result<()> {
    let cases =
        arguments.threads.iter().flat_map(|&threads| arguments.dmp.iter().map(move |dmp| (dmp, threads)));
    let mut cases: Vec<Case> =
        cases.map(|(dmp, threads)| Case { dmp, threads, measured: Vec::new() }).collect();
    for turn in 0..arguments.runs {
        // Every other turn in reverse: what a case leaves behind is not always for the same one.
        let mut order: Vec<usize> = (0..cases.len()).collect();
        if turn % 2 == 1 {
            order.reverse();
        }
        for k in order {
            let measured = score(arguments, &cases[k])?;
            cases[k].measured.push(measured);
        }
    }
    let returns = cases.iter().flat_map(|case| &case.measured).map(|one| one.1.inputs.returns).max();
    let returns = returns.unwrap_or(0) as f64;
    println!(
        "dmp score, runs: {}, {:.1} M points, the log in the page cache, {} times each, interleaved; {}",
        arguments.trajectory.len(),
        returns / 1e6,
        arguments.runs,
        circumstances()
    );
    println!(
        "{:<9}{:>18}{:>18}{:>8}{:>10}{:>10}{:>10}{:>10}{:>8}",
        "threads",
        "M points/core s",
        "least – largest",
        "busy",
        "open ns",
        "plan ns",
        "fuse ns",
        "cast ns",
        "all s"
    );
    // Every run is scored on every point.
    let returns = returns * arguments.trajectory.len() as f64;
    for of_threads in cases.chunks(arguments.dmp.len()) {
        for (k, case) in of_threads.iter().enumerate() {
            print_case(case, returns);
            if k > 0 {
                println!("         {}{}", case.dmp.display(), beside(&of_threads[0], case));
            }
        }
    }
    println!(
        "stages: wall time times threads, a point and run; busy: processor time by wall time and threads"
    );
    Ok(())
}

fn print_case(case: &Case, returns: f64) {
    let threads = case.threads;
    let of = |value: &dyn Fn(&Measured) -> f64| spread(case.measured.iter().map(value).collect());
    let [speed, least, largest] = of(&|(taken, _)| returns / taken.on_cores_s / 1e6);
    let [busy, ..] = of(&|(taken, _)| taken.on_cores_s / (taken.wall_s * f64::from(threads)));
    // A stage takes the cores for as long as it lasts.
    let stage = |seconds: &dyn Fn(&Measured) -> f64| of(seconds)[0] * f64::from(threads) / returns * 1e9;
    println!(
        "{threads:<9}{speed:>18.2}{:>18}{:>7.0}%{:>10.1}{:>10.1}{:>10.1}{:>10.1}{:>8.1}",
        format!("{least:.2} – {largest:.2}"),
        busy * 100.0,
        stage(&|(taken, report)| taken.wall_s - report.timing.total_s),
        stage(&|(_, report)| report.timing.plan_s),
        stage(&|(_, report)| report.timing.fuse_s),
        stage(&|(_, report)| report.timing.cast_s),
        of(&|(taken, _)| taken.wall_s)[0],
    );
}

/// The speed relative to the first command: medians of the ratios in the same turn.
fn beside(first: &Case, case: &Case) -> String {
    let ratio = |seconds: &dyn Fn(&Measured) -> f64| {
        let of_turns = first.measured.iter().zip(&case.measured);
        let [median, least, largest] =
            spread(of_turns.map(|(first, one)| seconds(first) / seconds(one)).collect());
        format!("{median:.3}x ({least:.3} – {largest:.3})")
    };
    format!(
        ": speed relative to the first, turn by turn: on cores {}, casting {}",
        ratio(&|(taken, _)| taken.on_cores_s),
        ratio(&|(_, report)| report.timing.cast_s)
    )
}

fn score(arguments: &ScoreArgs, case: &Case) -> anyhow::Result<Measured> {
    let mut command = Command::new(case.dmp);
    command.arg("score").arg(&arguments.log);
    for run in &arguments.trajectory {
        command.arg("-t").arg(run);
    }
    command.args(["--json", "--quiet", "--threads", &case.threads.to_string()]);
    let (taken, printed) = taken_by(&mut command)?;
    Ok((taken, serde_json::from_slice(&printed).context("the JSON of dmp score")?))
}
