//! What `--report` adds to a score.

use std::fs;
use std::path::PathBuf;
use std::process::Command;

use clap::Args;

use super::city::{City, drift_of, truth_of};
use super::taken::{Taken, taken_by};
use super::times::{circumstances, spread};

/// `dmp score` of a simulated city, the truth against a drift of 1 m, with `--report` and without, in turns
#[derive(Debug, Args)]
pub(crate) struct ReportArgs {
    /// Lengths of the drives, kilometres, comma-separated
    #[arg(long, value_delimiter = ',', default_values_t = [0.52, 2.08])]
    km: Vec<f64>,
    /// Share of the way that is driven a second time
    #[arg(long, default_value_t = 0.3)]
    revisit: f64,
    /// Scores of each kind
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u64).range(1..))]
    runs: u64,
    /// Where the logs are kept; one that is there already is used again
    #[arg(long, default_value = "target/scale")]
    folder: PathBuf,
}

pub(crate) fn run(arguments: &ReportArgs) -> anyhow::Result<()> {
    fs::create_dir_all(&arguments.folder)?;
    let dmp = std::env::current_exe()?.with_file_name("dmp");
    anyhow::ensure!(dmp.exists(), "no {}: cargo build --release -p dmp-cli", dmp.display());
    println!("two runs, {} scores of each kind in turns, medians; {}", arguments.runs, circumstances());
    println!(
        "{:>6}{:>10}{:>13}{:>13}{:>10}{:>12}{:>10}",
        "km", "log MB", "core s", "with page", "ratio", "wall ratio", "page MB"
    );
    for &km in &arguments.km {
        let city = City { km, revisit: arguments.revisit, azimuth_steps: 1024 };
        let log = city.log(&arguments.folder, &dmp)?;
        let wrong = drift_of(&log, 1, &dmp)?;
        let page = arguments.folder.join("report.html");
        let score = |with_page: bool| -> anyhow::Result<Taken> {
            let mut command = Command::new(&dmp);
            command.arg("score").arg(&log).arg("-t").arg(format!("truth={}", truth_of(&log).display()));
            command.arg("-t").arg(format!("drift={}", wrong.display()));
            command.args(["--json", "--quiet", "--work"]).arg(&arguments.folder);
            if with_page {
                command.arg("--report").arg(&page);
            }
            Ok(taken_by(&mut command)?.0)
        };
        let (mut without, mut with) = (Vec::new(), Vec::new());
        for _ in 0..arguments.runs {
            without.push(score(false)?);
            with.push(score(true)?);
        }
        let medians =
            |of: fn(&Taken) -> f64| [&without, &with].map(|taken| spread(taken.iter().map(of).collect())[0]);
        let [core_s, core_with_s] = medians(|taken| taken.on_cores_s);
        let [wall_s, wall_with_s] = medians(|taken| taken.wall_s);
        println!(
            "{km:>6}{:>10.0}{core_s:>13.2}{core_with_s:>13.2}{:>10.3}{:>12.3}{:>10.2}",
            fs::metadata(&log)?.len() as f64 / 1e6,
            core_with_s / core_s,
            wall_with_s / wall_s,
            fs::metadata(&page)?.len() as f64 / 1e6
        );
    }
    Ok(())
}
