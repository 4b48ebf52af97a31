//! `dmp loops` on a drive of hundreds of dense scans.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::Context as _;
use clap::Args;

use super::taken::{Taken, taken_by};
use super::times::circumstances;

/// `dmp loops` of a simulated city: a hundred candidates by patches, and the first few directly
#[derive(Debug, Args)]
pub(crate) struct LoopsArgs {
    /// Length of the drive, kilometres
    #[arg(long, default_value_t = 0.7)]
    km: f64,
    /// Firings in a turn of 64 beams
    #[arg(long, default_value_t = 1850)]
    azimuth_steps: u32,
    /// True, false and nearly right candidates, comma-separated
    #[arg(long, value_delimiter = ',', default_values_t = [40, 40, 20])]
    candidates: Vec<u32>,
    /// How many of them are ranked directly; 0 for none
    #[arg(long, default_value_t = 4)]
    direct: usize,
    /// Memory to aim for
    #[arg(long, default_value = "2GiB")]
    memory: String,
    /// Where the log is kept; one that is there already is used again
    #[arg(long, default_value = "target/scale")]
    folder: PathBuf,
}

/// Scans a second: about one a metre.
const RATE_HZ: &str = "5.6";

pub(crate) fn run(arguments: &LoopsArgs) -> anyhow::Result<()> {
    fs::create_dir_all(&arguments.folder)?;
    let dmp = std::env::current_exe()?.with_file_name("dmp");
    anyhow::ensure!(dmp.exists(), "no {}: cargo build --release -p dmp-cli", dmp.display());
    let (log, graph) = drive(arguments, &dmp)?;
    let all = graph.join("candidates.g2o");
    let few = graph.join("few.g2o");
    let text = fs::read_to_string(&all)?;
    fs::write(&few, text.split_inclusive('\n').take(arguments.direct).collect::<String>())?;

    println!("{}", circumstances());
    println!(
        "{:<10}{:>12}{:>9}{:>9}{:>18}{:>17}{:>9}{:>10}",
        "way", "candidates", "wall s", "core s", "of which reading", "a candidate, s", "AP", "anon MiB"
    );
    let fast = rank(&log, &graph, &all, &[], &dmp, arguments)?;
    fast.print("patches");
    if arguments.direct > 0 {
        let direct = rank(&log, &graph, &few, &["--direct"], &dmp, arguments)?;
        direct.print("direct");
        println!("a candidate directly takes {:.1} times as long", direct.each_s() / fast.each_s());
    }
    Ok(())
}

struct Ranked {
    taken: Taken,
    candidates: usize,
    read_s: f64,
    rank_s: f64,
    average_precision: Option<f64>,
}

impl Ranked {
    /// The graph without candidates is scored as one of them.
    fn each_s(&self) -> f64 {
        self.rank_s / (self.candidates + 1) as f64
    }

    fn print(&self, way: &str) {
        println!(
            "{way:<10}{:>12}{:>9.1}{:>9.1}{:>18.1}{:>17.2}{:>9}{:>10}",
            self.candidates,
            self.taken.wall_s,
            self.taken.on_cores_s,
            self.read_s,
            self.each_s(),
            self.average_precision.map_or("-".to_owned(), |ap| format!("{ap:.3}")),
            self.taken.peak_anon_bytes >> 20
        );
    }
}

fn rank(
    log: &Path,
    graph: &Path,
    candidates: &Path,
    more: &[&str],
    dmp: &Path,
    arguments: &LoopsArgs,
) -> anyhow::Result<Ranked> {
    let mut command = Command::new(dmp);
    command.arg("loops").arg(graph.join("graph.g2o")).arg("--candidates").arg(candidates);
    command.arg("--log").arg(log).arg("--keyframes").arg(graph.join("keyframes.txt"));
    command.arg("--truth").arg(graph.join("labels.csv")).args(["--json", "--quiet", "--memory"]);
    command.arg(&arguments.memory).arg("--work").arg(&arguments.folder).args(more);
    let (taken, output) = taken_by(&mut command)?;
    let result: serde_json::Value = serde_json::from_slice(&output).context("no JSON")?;
    let seconds = |name: &str| result["timing"][name].as_f64().context("no times");
    Ok(Ranked {
        taken,
        candidates: result["candidates"].as_array().context("no candidates")?.len(),
        read_s: seconds("read_s")?,
        rank_s: seconds("rank_s")?,
        average_precision: result["truth"]["average_precision"].as_f64(),
    })
}

/// The log of the drive, and the folder with its graph and candidates.
fn drive(arguments: &LoopsArgs, dmp: &Path) -> anyhow::Result<(PathBuf, PathBuf)> {
    let LoopsArgs { km, azimuth_steps, folder, .. } = arguments;
    let name = format!("loops-{km}km-{azimuth_steps}");
    let (log, graph) = (folder.join(format!("{name}.mcap")), folder.join(format!("{name}.graph")));
    let truth = log.with_extension("truth.tum");
    let made = |command: &mut Command| -> anyhow::Result<()> {
        let output = command.output()?;
        anyhow::ensure!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        print!("{}", String::from_utf8_lossy(&output.stdout));
        Ok(())
    };
    if !log.exists() {
        let mut command = Command::new(dmp);
        command.args([
            "simulate",
            "city",
            "--quiet",
            "--beams",
            "64",
            "--revisit",
            "0.45",
            "--rate",
            RATE_HZ,
        ]);
        command.args(["--truth-rate", RATE_HZ, "--km", &km.to_string()]);
        command.args(["--azimuth-steps", &azimuth_steps.to_string(), "-o"]).arg(&log);
        made(&mut command)?;
    }
    let mut command = Command::new(dmp);
    command.args(["simulate", "loops", "--spacing", "0"]).arg(&truth).arg("-o").arg(&graph);
    for (kind, count) in ["--true", "--false", "--near"].into_iter().zip(&arguments.candidates) {
        command.arg(kind).arg(count.to_string());
    }
    made(&mut command)?;
    Ok((log, graph))
}
