//! `cargo xtask bench scale`: how memory, time and I/O grow with the length of a log.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::Context as _;
use clap::Args;
use serde_json::Value;

use super::taken::{Taken, taken_by};
use super::times::circumstances;

/// Score logs of a city of 1, 4 and 16 times the length in the same memory
#[derive(Debug, Args)]
pub(crate) struct ScaleArgs {
    /// Length of the shortest drive, kilometres
    #[arg(long, default_value_t = 0.52)]
    km: f64,
    /// Lengths of the drives as multiples of that, comma-separated
    #[arg(long, value_delimiter = ',', default_values_t = [1, 4, 16])]
    times: Vec<u32>,
    /// Share of the path that is driven a second time
    #[arg(long, default_value_t = 0.3)]
    revisit: f64,
    /// Firings of the sensor per turn
    #[arg(long, default_value_t = 1024)]
    azimuth_steps: u32,
    /// Memory for scoring
    #[arg(long, default_value = "512MiB")]
    memory: String,
    /// Drifting trajectories that are scored beside the true one
    #[arg(long, default_value_t = 1)]
    wrong: u32,
    /// Also score with unlimited memory; fail where a number differs
    #[arg(long)]
    compare: bool,
    /// Folder of the logs; a log that exists is used again
    #[arg(long, default_value = "target/scale")]
    folder: PathBuf,
}

pub(crate) fn run(arguments: &ScaleArgs) -> anyhow::Result<()> {
    fs::create_dir_all(&arguments.folder)?;
    let dmp = std::env::current_exe()?.with_file_name("dmp");
    anyhow::ensure!(dmp.exists(), "no {}: cargo build --release -p dmp-cli", dmp.display());
    println!(
        "{} beside the true trajectory, {} of memory; {}",
        arguments.wrong,
        arguments.memory,
        circumstances()
    );
    println!(
        "{:>7}{:>10}{:>8}{:>9}{:>9}{:>9}{:>8}{:>11}{:>10}{:>11}{:>8}{:>8}{:>8}",
        "km",
        "M points",
        "log GB",
        "anon MiB",
        "wall s",
        "core s",
        "busy %",
        "ns a point",
        "read GB",
        "written GB",
        "tiles",
        "visits",
        "loads"
    );
    let mut rows = Vec::new();
    for times in &arguments.times {
        let km = arguments.km * f64::from(*times);
        let log = made(arguments, &dmp, km)?;
        let mut command = score(arguments, &dmp, &log, &arguments.memory);
        let (taken, report) = measured(&mut command)?;
        let row = Row::new(km, &log, &taken, &report)?;
        row.print();
        rows.push(row);
        if arguments.compare {
            let (_, unlimited) = measured(&mut score(arguments, &dmp, &log, "unlimited"))?;
            let same = numbers(&report) == numbers(&unlimited);
            println!("        unlimited memory: {}", if same { "the same bits" } else { "OTHER NUMBERS" });
            anyhow::ensure!(same, "{km} km: memory changed a number");
        }
    }
    if let (Some(first), Some(last)) = (rows.first(), rows.last()) {
        println!("time a point, longest to shortest: {:.3}", last.ns_a_point / first.ns_a_point);
    }
    Ok(())
}

/// The log of a drive, with its truth and wrong trajectories beside it; made where they are missing.
fn made(arguments: &ScaleArgs, dmp: &Path, km: f64) -> anyhow::Result<PathBuf> {
    let ScaleArgs { revisit, azimuth_steps, folder, .. } = arguments;
    let log = folder.join(format!("city-{km}-{revisit}-{azimuth_steps}.mcap"));
    if !log.exists() {
        let mut command = Command::new(dmp);
        command.args(["simulate", "city", "--quiet", "--km", &km.to_string()]);
        command.args(["--revisit", &revisit.to_string()]);
        command.args(["--azimuth-steps", &azimuth_steps.to_string(), "-o"]).arg(&log);
        finish(&mut command)?;
    }
    for number in 1..=arguments.wrong {
        let wrong = drift_of(&log, number);
        if !wrong.exists() {
            let mut command = Command::new(dmp);
            command.args(["simulate", "errors", "--quiet"]).arg(truth_of(&log));
            command.args(["--drift-ate", "1", "--seed", &number.to_string(), "-o"]).arg(&wrong);
            finish(&mut command)?;
        }
    }
    Ok(log)
}

fn finish(command: &mut Command) -> anyhow::Result<()> {
    let output = command.stdin(Stdio::null()).output()?;
    anyhow::ensure!(output.status.success(), "{command:?}: {}", String::from_utf8_lossy(&output.stderr));
    Ok(())
}

fn truth_of(log: &Path) -> PathBuf {
    log.with_extension("truth.tum")
}

/// A trajectory that drifts from the truth by an ATE of 1 m.
fn drift_of(log: &Path, number: u32) -> PathBuf {
    log.with_extension(format!("drift-{number}.tum"))
}

fn score(arguments: &ScaleArgs, dmp: &Path, log: &Path, memory: &str) -> Command {
    let mut command = Command::new(dmp);
    command.arg("score").arg(log).arg("-t").arg(named("truth", &truth_of(log)));
    for number in 1..=arguments.wrong {
        command.arg("-t").arg(named(&format!("drift-{number}"), &drift_of(log, number)));
    }
    command.args(["--json", "--quiet", "--memory", memory, "--work"]).arg(&arguments.folder);
    command
}

fn named(name: &str, file: &Path) -> String {
    format!("{name}={}", file.display())
}

/// Runs a command to its end; its resources and its report.
fn measured(command: &mut Command) -> anyhow::Result<(Taken, Value)> {
    let (taken, printed) = taken_by(command)?;
    Ok((taken, serde_json::from_slice(&printed)?))
}

/// All fields that must not depend on the memory.
fn numbers(report: &Value) -> BTreeMap<String, Value> {
    let object = report.as_object().cloned().unwrap_or_default();
    object.into_iter().filter(|(key, _)| key != "timing" && key != "memory").collect()
}

struct Row {
    km: f64,
    points: f64,
    log_bytes: u64,
    anon_bytes: u64,
    wall_s: f64,
    core_s: f64,
    busy: f64,
    ns_a_point: f64,
    read_bytes: u64,
    written_bytes: u64,
    tiles: u64,
    visits: u64,
    loads: u64,
}

impl Row {
    fn new(km: f64, log: &Path, taken: &Taken, report: &Value) -> anyhow::Result<Self> {
        let number =
            |at: &str| report.pointer(at).and_then(Value::as_u64).with_context(|| format!("no {at}"));
        let points = number("/inputs/returns")? as f64;
        let threads = number("/timing/threads")? as f64;
        Ok(Self {
            km,
            points,
            log_bytes: fs::metadata(log)?.len(),
            anon_bytes: taken.peak_anon_bytes,
            wall_s: taken.wall_s,
            core_s: taken.on_cores_s,
            busy: taken.on_cores_s / (taken.wall_s * threads),
            ns_a_point: taken.on_cores_s / points * 1e9,
            read_bytes: taken.read_bytes,
            written_bytes: taken.written_bytes,
            tiles: number("/memory/tiles_in_reach")?,
            visits: number("/memory/tile_visits")?,
            loads: number("/memory/tile_loads")?,
        })
    }

    fn print(&self) {
        println!(
            "{:>7}{:>10.1}{:>8.2}{:>9.0}{:>9.1}{:>9.1}{:>8.0}{:>11.0}{:>10.2}{:>11.2}{:>8}{:>8}{:>8}",
            self.km,
            self.points / 1e6,
            self.log_bytes as f64 / 1e9,
            self.anon_bytes as f64 / f64::from(1 << 20),
            self.wall_s,
            self.core_s,
            100.0 * self.busy,
            self.ns_a_point,
            self.read_bytes as f64 / 1e9,
            self.written_bytes as f64 / 1e9,
            self.tiles,
            self.visits,
            self.loads
        );
    }
}
