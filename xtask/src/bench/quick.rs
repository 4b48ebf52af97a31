//! A quick score beside one of the whole log.

use std::fs;
use std::path::PathBuf;
use std::process::Command;

use anyhow::Context as _;
use clap::Args;
use serde_json::Value;

use super::city::{City, drift_of, truth_of};
use super::taken::{Taken, taken_by};
use super::times::{circumstances, drop_pages, spread};

/// `dmp score --quick` on a long log of a city, the truth against a drift of 1 m, beside the whole score: bytes read,
/// time, verdict
#[derive(Debug, Args)]
pub(crate) struct QuickArgs {
    /// Length of the drive, kilometres
    #[arg(long, default_value_t = 18.5)]
    km: f64,
    /// Share of the way that is driven a second time
    #[arg(long, default_value_t = 0.3)]
    revisit: f64,
    /// Share of the log's bytes that may be read
    #[arg(long, default_value = "5%")]
    share: String,
    /// Quick scores, each with a seed of its own
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u64).range(1..))]
    runs: u64,
    /// Memory for scoring
    #[arg(long, default_value = "2GiB")]
    memory: String,
    /// Where the log is kept; one that is there already is used again
    #[arg(long, default_value = "target/quick")]
    folder: PathBuf,
}

pub(crate) fn run(arguments: &QuickArgs) -> anyhow::Result<()> {
    fs::create_dir_all(&arguments.folder)?;
    let dmp = std::env::current_exe()?.with_file_name("dmp");
    anyhow::ensure!(dmp.exists(), "no {}: cargo build --release -p dmp-cli", dmp.display());
    let city = City { km: arguments.km, revisit: arguments.revisit, azimuth_steps: 1024 };
    let log = city.log(&arguments.folder, &dmp)?;
    let wrong = drift_of(&log, 1, &dmp)?;
    let score = |more: &[&str]| -> anyhow::Result<Row> {
        let mut command = Command::new(&dmp);
        command.arg("score").arg(&log).arg("-t").arg(format!("truth={}", truth_of(&log).display()));
        command.arg("-t").arg(format!("drift={}", wrong.display()));
        command.args(["--json", "--quiet", "--memory", &arguments.memory, "--work"]).arg(&arguments.folder);
        command.args(more);
        drop_pages(&log)?;
        let (taken, said) = taken_by(&mut command)?;
        Ok(Row { taken, report: serde_json::from_slice(&said)? })
    };
    let bytes = fs::metadata(&log)?.len();
    println!(
        "{} km, {:.2} GB, the truth against a drift of 1 m, read from disk, {} of memory; {}",
        arguments.km,
        bytes as f64 / 1e9,
        arguments.memory,
        circumstances()
    );
    println!(
        "{:<14}{:>9}{:>8}{:>9}{:>9}{:>9}{:>8}{:>9}   at 10 m: difference, its interval, m²",
        "", "read MB", "of log", "wall s", "core s", "places", "scans", "verdict"
    );
    let mut quick = Vec::new();
    for seed in 0..arguments.runs {
        let row = score(&[&format!("--quick={}", arguments.share), "--seed", &seed.to_string()])?;
        row.print(&format!("quick, seed {seed}"), bytes)?;
        quick.push(row);
    }
    let whole = score(&[])?;
    whole.print("whole", bytes)?;
    let [wall_s, ..] = spread(quick.iter().map(|row| row.taken.wall_s).collect());
    let [core_s, ..] = spread(quick.iter().map(|row| row.taken.on_cores_s).collect());
    println!(
        "quick by whole, medians: wall time {:.4}, time on cores {:.4}; bytes read are those that the process asked for, what \
         is read twice counted twice",
        wall_s / whole.taken.wall_s,
        core_s / whole.taken.on_cores_s
    );
    Ok(())
}

struct Row {
    taken: Taken,
    report: Value,
}

impl Row {
    fn print(&self, name: &str, log_bytes: u64) -> anyhow::Result<()> {
        let at = |path: &str| self.report.pointer(path).with_context(|| format!("no {path}"));
        let number = |path: &str| at(path).map(|value| value.as_f64().unwrap_or(f64::NAN));
        let places = self.report.pointer("/sampling/places/drawn").and_then(Value::as_u64);
        println!(
            "{name:<14}{:>9.0}{:>7.1}%{:>9.1}{:>9.1}{:>9}{:>8}{:>9}   {:.3}, {:.3} to {:.3}",
            self.taken.read_bytes as f64 / 1e6,
            100.0 * self.taken.read_bytes as f64 / log_bytes as f64,
            self.taken.wall_s,
            self.taken.on_cores_s,
            places.map_or("–".to_owned(), |places| places.to_string()),
            number("/sampling/frames_scored")?,
            at("/pairs/0/verdict")?.as_str().unwrap_or_default(),
            number("/pairs/0/scales/0/difference_m2")?,
            number("/pairs/0/scales/0/interval_m2/0")?,
            number("/pairs/0/scales/0/interval_m2/1")?,
        );
        Ok(())
    }
}
