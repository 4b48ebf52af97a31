//! Benchmarks: what `docs/performance.md` tells comes from here.

mod cast;
mod city;
mod decode;
mod fuse;
mod loops;
mod quick;
mod report;
mod room;
mod scale;
mod score;
mod simulate;
mod store;
mod taken;
mod truth;

use std::process::{Command, Stdio};
use std::time::Instant;

use anyhow::Context as _;
use clap::Subcommand;
use rustix::fs::{Advice, fadvise};

/// Measure the command on this machine
#[derive(Debug, Subcommand)]
pub(crate) enum Bench {
    Cast(Box<cast::CastArgs>),
    #[command(hide = true)]
    CastServe(cast::serve::ServeArgs),
    Decode(decode::DecodeArgs),
    Fuse(fuse::FuseArgs),
    Loops(loops::LoopsArgs),
    Quick(quick::QuickArgs),
    Report(report::ReportArgs),
    Room(room::RoomArgs),
    Scale(scale::ScaleArgs),
    Score(score::ScoreArgs),
    Simulate(simulate::SimulateArgs),
    Store(store::StoreArgs),
    Truth(truth::TruthArgs),
}

pub(crate) fn run(bench: &Bench) -> anyhow::Result<()> {
    match bench {
        Bench::Cast(arguments) => cast::run(arguments),
        Bench::CastServe(arguments) => cast::serve::run(arguments),
        Bench::Decode(arguments) => decode::run(arguments),
        Bench::Loops(arguments) => loops::run(arguments),
        Bench::Quick(arguments) => quick::run(arguments),
        Bench::Report(arguments) => report::run(arguments),
        Bench::Room(arguments) => room::run(arguments),
        Bench::Scale(arguments) => scale::run(arguments),
        Bench::Fuse(arguments) => fuse::run(arguments),
        Bench::Score(arguments) => score::run(arguments),
        Bench::Simulate(arguments) => simulate::run(arguments),
        Bench::Store(arguments) => store::run(arguments),
        Bench::Truth(arguments) => truth::run(arguments),
    }
}

/// Seconds a command takes from its start to its end; it must succeed.
fn seconds(command: &[String]) -> anyhow::Result<f64> {
    let (program, arguments) = command.split_first().context("no command")?;
    let start = Instant::now();
    let output = Command::new(program).args(arguments).stdin(Stdio::null()).output();
    let taken_s = start.elapsed().as_secs_f64();
    let output = output.with_context(|| format!("{program}: cannot start"))?;
    anyhow::ensure!(
        output.status.success(),
        "{}: {}: {}",
        command.join(" "),
        output.status,
        String::from_utf8_lossy(&output.stderr)
    );
    Ok(taken_s)
}

/// How long this thread has run on a core, seconds: what else runs on the machine does not count.
fn on_core_s() -> anyhow::Result<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat")?;
    let ns = text.split(' ').next().context("an empty schedstat")?;
    Ok(ns.parse::<u64>()? as f64 / 1e9)
}

/// Takes a file out of the page cache; nothing of it may be mapped.
fn drop_pages(path: &std::path::Path) -> anyhow::Result<()> {
    let file = std::fs::File::open(path)?;
    // Only pages that are on disk can be dropped.
    file.sync_all()?;
    fadvise(&file, 0, None, Advice::DontNeed)?;
    Ok(())
}

/// Median, least and largest of some times. There must be one.
fn spread(mut times_s: Vec<f64>) -> [f64; 3] {
    times_s.sort_by(f64::total_cmp);
    let (half, last) = (times_s.len() / 2, times_s.len() - 1);
    let median =
        if times_s.len() % 2 == 1 { times_s[half] } else { f64::midpoint(times_s[half - 1], times_s[half]) };
    [median, times_s[0], times_s[last]]
}

/// The machine and the day, as they stand over every table of times.
fn circumstances() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = text.lines().find_map(|line| line.strip_prefix("model name")?.split(": ").nth(1));
    let cores = std::thread::available_parallelism().map_or(0, std::num::NonZero::get);
    let load = std::fs::read_to_string("/proc/loadavg").unwrap_or_default();
    let load = load.split(' ').next().unwrap_or("unknown").to_owned();
    let date = Command::new("date").args(["-u", "+%Y-%m-%d"]).output().map(|output| output.stdout);
    let date = String::from_utf8(date.unwrap_or_default()).unwrap_or_default();
    format!("{}, {cores} cores, load {load}, {}", model.unwrap_or("unknown processor"), date.trim())
}
