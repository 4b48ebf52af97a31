//! How long something takes, on which machine.

use std::process::{Command, Stdio};
use std::time::Instant;

use anyhow::Context as _;
use rustix::fs::{Advice, fadvise};

/// Seconds a command takes from its start to its end; it must succeed.
pub(super) fn seconds(command: &[String]) -> anyhow::Result<f64> {
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
pub(super) fn on_core_s() -> anyhow::Result<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat")?;
    let ns = text.split(' ').next().context("an empty schedstat")?;
    Ok(ns.parse::<u64>()? as f64 / 1e9)
}

/// Takes a file out of the page cache; nothing of it may be mapped.
pub(super) fn drop_pages(path: &std::path::Path) -> anyhow::Result<()> {
    let file = std::fs::File::open(path)?;
    // Only pages that are on disk can be dropped.
    file.sync_all()?;
    fadvise(&file, 0, None, Advice::DontNeed)?;
    Ok(())
}

/// Median, least and largest of some times. There must be one.
pub(super) fn spread(mut times_s: Vec<f64>) -> [f64; 3] {
    times_s.sort_by(f64::total_cmp);
    let (half, last) = (times_s.len() / 2, times_s.len() - 1);
    let median =
        if times_s.len() % 2 == 1 { times_s[half] } else { f64::midpoint(times_s[half - 1], times_s[half]) };
    [median, times_s[0], times_s[last]]
}

/// The machine and the day, as they stand over every table of times.
pub(crate) fn circumstances() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = text.lines().find_map(|line| line.strip_prefix("model name")?.split(": ").nth(1));
    let cores = std::thread::available_parallelism().map_or(0, std::num::NonZero::get);
    let load = std::fs::read_to_string("/proc/loadavg").unwrap_or_default();
    let load = load.split(' ').next().unwrap_or("unknown").to_owned();
    let date = Command::new("date").args(["-u", "+%Y-%m-%d"]).output().map(|output| output.stdout);
    let date = String::from_utf8(date.unwrap_or_default()).unwrap_or_default();
    format!("{}, {cores} cores, load {load}, {}", model.unwrap_or("unknown processor"), date.trim())
}
