//! How fast drift is measured.

use std::path::PathBuf;
use std::process::Command;

use anyhow::Context as _;
use clap::Args;
use serde_json::Value;

use super::city::{City, drift_of, truth_of};
use super::taken::taken_by;
use super::times::{circumstances, spread};

/// `dmp drift` on a drive through a city that comes back, beside the whole score of the same runs: time, pairs of visits
#[derive(Debug, Args)]
pub(crate) struct DriftArgs {
    /// Length of the drive, kilometres
    #[arg(long, default_value_t = 2.0)]
    km: f64,
    /// Share of the way that is driven a second time
    #[arg(long, default_value_t = 0.3)]
    revisit: f64,
    /// Runs of each command
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u64).range(1..))]
    runs: u64,
    /// Without the scores
    #[arg(long)]
    alone: bool,
    /// Where the log is kept; one that is there already is used again
    #[arg(long, default_value = "target/drift")]
    folder: PathBuf,
}

/// Runs of the calls with many.
const MANY: u32 = 8;

/// A call of the command.
struct Call {
    what: &'static str,
    more: &'static [&'static str],
    /// The truth, and others that drift.
    runs: u32,
}

const CALLS: [Call; 6] = [
    Call { what: "drift", more: &[], runs: 2 },
    Call { what: "drift", more: &["--pairs", "1"], runs: 2 },
    // What is read once is read for all runs.
    Call { what: "drift", more: &[], runs: MANY },
    Call { what: "drift", more: &["--pairs", "1"], runs: MANY },
    Call { what: "score", more: &["--drift=none"], runs: 2 },
    Call { what: "score", more: &["--drift"], runs: 2 },
];

pub(crate) fn run(arguments: &DriftArgs) -> anyhow::Result<()> {
    std::fs::create_dir_all(&arguments.folder)?;
    let dmp = std::env::current_exe()?.with_file_name("dmp");
    anyhow::ensure!(dmp.exists(), "no {}: cargo build --release -p dmp-cli", dmp.display());
    let city = City { km: arguments.km, revisit: arguments.revisit, azimuth_steps: 1024 };
    let log = city.log(&arguments.folder, &dmp)?;
    let drifted = (1..MANY).map(|seed| drift_of(&log, seed, &dmp)).collect::<anyhow::Result<Vec<_>>>()?;
    let call = |call: &Call| -> anyhow::Result<(f64, Value)> {
        let mut command = Command::new(&dmp);
        command.arg(call.what).arg(&log).arg("-t").arg(format!("truth={}", truth_of(&log).display()));
        for run in &drifted[..call.runs as usize - 1] {
            command.arg("-t").arg(run);
        }
        command.args(["--trust", "--json", "--quiet", "--work"]).arg(&arguments.folder).args(call.more);
        let (taken, said) = taken_by(&mut command)?;
        Ok((taken.on_cores_s, serde_json::from_slice(&said)?))
    };
    println!(
        "{} km, time on cores, {} runs of each, interleaved; {}",
        arguments.km,
        arguments.runs,
        circumstances()
    );
    let calls = if arguments.alone { &CALLS[..4] } else { &CALLS[..] };
    let mut times_s = vec![Vec::new(); calls.len()];
    let mut pairs = vec![0; calls.len()];
    for _ in 0..arguments.runs {
        for (which, one) in calls.iter().enumerate() {
            let (on_cores_s, said) = call(one)?;
            times_s[which].push(on_cores_s);
            let drift = if one.what == "drift" { &said } else { &said["drift"] };
            pairs[which] = drift.get("pairs_measured").and_then(Value::as_u64).unwrap_or(0);
        }
    }
    let times_s: Vec<[f64; 3]> = times_s.into_iter().map(spread).collect();
    println!("{:<24}{:>6}{:>8}{:>12}{:>20}", "", "runs", "pairs", "median s", "least – largest s");
    for ((call, pairs), [middle, least, most]) in calls.iter().zip(&pairs).zip(&times_s) {
        let name = format!("dmp {} {}", call.what, call.more.join(" "));
        println!("{name:<24}{:>6}{pairs:>8}{middle:>12.2}{least:>12.2} – {most:.2}", call.runs);
    }
    let more = |all: usize, one: usize| {
        pairs[all].checked_sub(pairs[one]).filter(|more| *more > 0).context("the drive comes back too seldom")
    };
    for (all, one) in [(0, 1), (2, 3)] {
        let runs = CALLS[all].runs;
        let each_s = (times_s[all][0] - times_s[one][0]) / (u64::from(runs) * more(all, one)?) as f64;
        println!(
            "{runs} runs: {:.1} ms for a pair in a run beyond the first pair: {:.0} a minute and core",
            1e3 * each_s,
            60.0 / each_s
        );
    }
    if let [[all, ..], _, _, _, [score, ..], [both, ..]] = times_s[..] {
        println!("dmp drift by the score alone, medians: {:.3}", all / score);
        println!("the score with all pairs by the score alone: {:.3}", both / score);
    }
    Ok(())
}
