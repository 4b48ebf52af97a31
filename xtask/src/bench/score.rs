//! How fast a whole `dmp score` is.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

use anyhow::Context as _;
use clap::Args;
use serde::Deserialize;

use super::times::{circumstances, spread};

/// A whole `dmp score`: points per second of processor time, and how busy the cores were
#[derive(Debug, Args)]
pub(crate) struct ScoreArgs {
    /// The log
    log: PathBuf,
    /// A run; may be given several times
    #[arg(long, required = true)]
    trajectory: Vec<PathBuf>,
    /// Threads of the command, each number in its turn
    #[arg(long, value_delimiter = ',', default_values_t = [1, 2])]
    threads: Vec<u32>,
    /// Runs of each, interleaved
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..))]
    runs: u32,
    /// The command, built in release; given several times, each in its turn, and the others are held against the first
    #[arg(long, default_value = "target/release/dmp")]
    dmp: Vec<PathBuf>,
}

/// What the command says of itself, as far as it is looked at.
#[derive(Debug, Deserialize)]
struct Said {
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

/// What one run took.
struct Taken {
    wall_s: f64,
    /// User and system time of all its threads.
    processor_s: f64,
    said: Said,
}

/// What is run in turns.
struct Way<'a> {
    dmp: &'a Path,
    threads: u32,
    taken: Vec<Taken>,
}

pub(crate) fn run(arguments: &ScoreArgs) -> anyhow::Result<()> {
    let of_threads =
        arguments.threads.iter().map(|&threads| arguments.dmp.iter().map(move |dmp| (dmp, threads)));
    let mut ways: Vec<Way> =
        of_threads.flatten().map(|(dmp, threads)| Way { dmp, threads, taken: Vec::new() }).collect();
    for turn in 0..arguments.runs {
        // Every other turn the other way round: what a way leaves behind is not always for the same one.
        let mut order: Vec<usize> = (0..ways.len()).collect();
        if turn % 2 == 1 {
            order.reverse();
        }
        for k in order {
            let taken = score(arguments, &ways[k])?;
            ways[k].taken.push(taken);
        }
    }
    let returns = ways.iter().flat_map(|way| &way.taken).map(|one| one.said.inputs.returns).max();
    let returns = returns.unwrap_or(0) as f64;
    let of_runs = match arguments.trajectory.len() {
        1 => "one run".to_owned(),
        many => format!("{many} runs"),
    };
    println!(
        "dmp score of {of_runs}, {:.1} M points, the log in the page cache, {} runs of each, interleaved; {}",
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
    for of_threads in ways.chunks(arguments.dmp.len()) {
        for way in of_threads {
            print_way(way, returns);
            if of_threads.len() > 1 {
                println!("         {}{}", way.dmp.display(), beside(&of_threads[0], way));
            }
        }
    }
    println!("stages by the clock, times threads, a point and run; busy: processor time by time and threads");
    Ok(())
}

fn print_way(way: &Way, returns: f64) {
    let (threads, taken) = (way.threads, &way.taken);
    let of = |value: &dyn Fn(&Taken) -> f64| spread(taken.iter().map(value).collect());
    let [speed, least, largest] = of(&|one| returns / one.processor_s / 1e6);
    let [busy, ..] = of(&|one| one.processor_s / (one.wall_s * f64::from(threads)));
    // A stage takes the cores for as long as it lasts: its time by the clock, of all threads, a point.
    let stage = |seconds: &dyn Fn(&Taken) -> f64| of(seconds)[0] * f64::from(threads) / returns * 1e9;
    println!(
        "{threads:<9}{speed:>18.2}{:>18}{:>7.0}%{:>10.1}{:>10.1}{:>10.1}{:>10.1}{:>8.1}",
        format!("{least:.2} – {largest:.2}"),
        busy * 100.0,
        stage(&|one| one.wall_s - one.said.timing.total_s),
        stage(&|one| one.said.timing.plan_s),
        stage(&|one| one.said.timing.fuse_s),
        stage(&|one| one.said.timing.cast_s),
        of(&|one| one.wall_s)[0],
    );
}

/// How many times as fast as the first, by the medians of the ratios in the same turn.
fn beside(first: &Way, way: &Way) -> String {
    if std::ptr::eq(first, way) {
        return String::new();
    }
    let ratio = |seconds: &dyn Fn(&Taken) -> f64| {
        let of_turns = first.taken.iter().zip(&way.taken).map(|(first, one)| seconds(first) / seconds(one));
        let [median, least, largest] = spread(of_turns.collect());
        format!("{median:.3}x ({least:.3} – {largest:.3})")
    };
    format!(
        ": as fast as the first, turn by turn: on cores {}, casting {}",
        ratio(&|one| one.processor_s),
        ratio(&|one| one.said.timing.cast_s)
    )
}

fn score(arguments: &ScoreArgs, way: &Way) -> anyhow::Result<Taken> {
    let mut command = Command::new(way.dmp);
    command.arg("score").arg(&arguments.log);
    for run in &arguments.trajectory {
        command.arg("-t").arg(run);
    }
    command.args(["--json", "--no-progress", "--threads", &way.threads.to_string()]);
    let (start, before_s) = (Instant::now(), of_children_s()?);
    let output = command.stdin(Stdio::null()).output();
    let wall_s = start.elapsed().as_secs_f64();
    let processor_s = of_children_s()? - before_s;
    let output = output.with_context(|| format!("{}: cannot start", way.dmp.display()))?;
    anyhow::ensure!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let said = serde_json::from_slice(&output.stdout).context("what the command printed")?;
    Ok(Taken { wall_s, processor_s, said })
}

/// User and system time of the processes that this one has waited for, seconds: fields 16 and 17 of proc(5)'s `stat`,
/// in hundredths on every Linux.
fn of_children_s() -> anyhow::Result<f64> {
    let text = std::fs::read_to_string("/proc/self/stat")?;
    // The second field, a name in brackets, may hold anything.
    let (_, rest) = text.rsplit_once(')').context("/proc/self/stat without a name")?;
    let hundredths = rest.split_whitespace().skip(13).take(2).map(str::parse::<u64>);
    Ok(hundredths.sum::<Result<u64, _>>()? as f64 / 100.0)
}
