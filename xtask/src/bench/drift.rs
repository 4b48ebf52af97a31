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
    /// Where the log is kept; one that is there already is used again
    #[arg(long, default_value = "target/drift")]
    folder: PathBuf,
}

pub(crate) fn run(arguments: &DriftArgs) -> anyhow::Result<()> {
    std::fs::create_dir_all(&arguments.folder)?;
    let dmp = std::env::current_exe()?.with_file_name("dmp");
    anyhow::ensure!(dmp.exists(), "no {}: cargo build --release -p dmp-cli", dmp.display());
    let city = City { km: arguments.km, revisit: arguments.revisit, azimuth_steps: 1024 };
    let log = city.log(&arguments.folder, &dmp)?;
    let wrong = drift_of(&log, 1, &dmp)?;
    let call = |what: &str, more: &[&str]| -> anyhow::Result<(f64, Value)> {
        let mut command = Command::new(&dmp);
        command.arg(what).arg(&log).arg("-t").arg(format!("truth={}", truth_of(&log).display()));
        command.arg("-t").arg(format!("drift={}", wrong.display()));
        command.args(["--trust", "--json", "--quiet", "--work"]).arg(&arguments.folder).args(more);
        let (taken, said) = taken_by(&mut command)?;
        Ok((taken.on_cores_s, serde_json::from_slice(&said)?))
    };
    println!(
        "{} km, two runs, time on cores, {} runs of each, interleaved; {}",
        arguments.km,
        arguments.runs,
        circumstances()
    );
    let calls: [(&str, &[&str]); 4] =
        [("drift", &[]), ("drift", &["--pairs", "1"]), ("score", &["--drift=none"]), ("score", &["--drift"])];
    let mut times_s = [const { Vec::new() }; 4];
    let mut pairs = [0; 4];
    for _ in 0..arguments.runs {
        for (which, (what, more)) in calls.iter().enumerate() {
            let (on_cores_s, said) = call(what, more)?;
            times_s[which].push(on_cores_s);
            let drift = if *what == "drift" { &said } else { &said["drift"] };
            pairs[which] = drift.get("pairs_measured").and_then(Value::as_u64).unwrap_or(0);
        }
    }
    let [all, one, score, both] = times_s.map(spread);
    println!("{:<28}{:>8}{:>12}{:>20}", "", "pairs", "median s", "least – largest s");
    for ((what, more), (pairs, [middle, least, most])) in
        calls.iter().zip(pairs.into_iter().zip([all, one, score, both]))
    {
        let name = format!("dmp {what} {}", more.join(" "));
        println!("{name:<28}{pairs:>8}{middle:>12.2}{least:>12.2} – {most:.2}");
    }
    let more =
        pairs[0].checked_sub(pairs[1]).filter(|more| *more > 0).context("the drive comes back too seldom")?;
    let each_s = (all[0] - one[0]) / (2 * more) as f64;
    println!(
        "{:.1} ms for a pair in a run beyond the first pair: {:.0} a minute and core",
        1e3 * each_s,
        60.0 / each_s
    );
    println!("dmp drift by the score alone, medians: {:.3}", all[0] / score[0]);
    println!("the score with all pairs by the score alone: {:.3}", both[0] / score[0]);
    Ok(())
}
