//! How fast drives through a city are simulated, and in how much memory.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::Context as _;
use clap::Args;

use super::taken::{Taken, taken_by};
use super::times::circumstances;

/// Drives of several lengths through a city: points per second of processor time, bytes, memory
#[derive(Debug, Args)]
pub(crate) struct SimulateArgs {
    /// Lengths of the drives, kilometres
    #[arg(long, value_delimiter = ',', default_values_t = [0.5, 2.0, 8.0])]
    km: Vec<f64>,
    /// Beams of the sensors
    #[arg(long, value_delimiter = ',', default_values_t = [64, 128])]
    beams: Vec<u32>,
    /// Where the logs are written; each is removed before the next
    #[arg(long, default_value = "target")]
    folder: PathBuf,
}

pub(crate) fn run(arguments: &SimulateArgs) -> anyhow::Result<()> {
    let dmp = std::env::current_exe()?.with_file_name("dmp");
    anyhow::ensure!(dmp.exists(), "no {}: cargo build --release -p dmp-cli", dmp.display());
    let folder = tempfile::tempdir_in(&arguments.folder)
        .with_context(|| format!("{}: cannot make a folder in it", arguments.folder.display()))?;
    println!("{}", circumstances());
    println!(
        "{:>5}{:>7}{:>10}{:>8}{:>16}{:>8}{:>8}{:>10}{:>10}",
        "beams", "km", "M points", "log GB", "bytes a point", "wall s", "core s", "M/core s", "anon MiB"
    );
    for beams in &arguments.beams {
        for km in &arguments.km {
            let log = folder.path().join("city.mcap");
            let mut command = Command::new(&dmp);
            command.args(["simulate", "city", "--no-progress", "--beams", &beams.to_string()]);
            command.args(["--km", &km.to_string(), "-o"]).arg(&log);
            let (taken, said) = taken_by(&mut command)?;
            print(*beams, *km, returns(&said)?, &taken, &log)?;
            fs::remove_file(&log)?;
        }
    }
    Ok(())
}

/// The number of returns that the command tells of.
fn returns(said: &[u8]) -> anyhow::Result<u64> {
    let said = String::from_utf8_lossy(said);
    let (before, _) = said.split_once(" returns").with_context(|| format!("no returns in: {said}"))?;
    let number = before.rsplit(' ').next().unwrap_or(before);
    number.parse().with_context(|| format!("no number of returns in: {said}"))
}

fn print(beams: u32, km: f64, returns: u64, taken: &Taken, log: &Path) -> anyhow::Result<()> {
    let (points, bytes) = (returns as f64, fs::metadata(log)?.len() as f64);
    println!(
        "{beams:>5}{km:>7}{:>10.1}{:>8.2}{:>16.2}{:>8.1}{:>8.1}{:>10.2}{:>10.0}",
        points / 1e6,
        bytes / 1e9,
        bytes / points,
        taken.wall_s,
        taken.on_cores_s,
        points / taken.on_cores_s / 1e6,
        taken.peak_anon_bytes as f64 / f64::from(1 << 20)
    );
    Ok(())
}
