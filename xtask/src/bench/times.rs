//! Statistics of times, and the machine that they were measured on.

use std::process::Command;

/// Median, least and largest of some times. There must be one.
pub(super) fn spread(mut times_s: Vec<f64>) -> [f64; 3] {
    times_s.sort_by(f64::total_cmp);
    let (half, last) = (times_s.len() / 2, times_s.len() - 1);
    let median =
        if times_s.len() % 2 == 1 { times_s[half] } else { f64::midpoint(times_s[half - 1], times_s[half]) };
    [median, times_s[0], times_s[last]]
}

/// The machine and the day, printed above every table of times.
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
