//! A depth camera's recording of the size of a TUM RGB-D sequence, scored at full resolution.

use std::fs;
use std::path::PathBuf;
use std::process::Command;

use anyhow::Context as _;
use clap::Args;
use serde_json::Value;

use super::taken::{Taken, taken_by};
use super::times::{circumstances, spread};

/// `dmp score` of one run on 600 depth images of 640 x 480 pixels, beside samples of its images
#[derive(Debug, Args)]
pub(crate) struct RoomArgs {
    /// Images
    #[arg(long, default_value_t = 600)]
    images: usize,
    /// How often each is scored
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u64).range(1..))]
    runs: u64,
    /// Where the recording is kept; one that is there already is used again
    #[arg(long, default_value = "target/room")]
    folder: PathBuf,
}

/// What is asked for beside the whole.
const WAYS: [(&str, &[&str]); 3] =
    [("every pixel", &[]), ("--sample 28", &["--sample", "28"]), ("--sample 5%", &["--sample", "5%"])];

pub(crate) fn run(arguments: &RoomArgs) -> anyhow::Result<()> {
    fs::create_dir_all(&arguments.folder)?;
    let dmp = std::env::current_exe()?.with_file_name("dmp");
    anyhow::ensure!(dmp.exists(), "no {}: cargo build --release -p dmp-cli", dmp.display());
    let room = arguments.folder.join(format!("room-{}", arguments.images));
    if !room.exists() {
        let mut simulate = Command::new(&dmp);
        simulate.args(["simulate", "room", "--frames", &arguments.images.to_string(), "-q", "-o"]).arg(&room);
        anyhow::ensure!(simulate.status()?.success(), "no room was made");
    }
    let score = |more: &[&str]| -> anyhow::Result<(Taken, Value)> {
        let mut command = Command::new(&dmp);
        command.arg("score").arg(&room).arg("-t").arg(room.join("estimates/good.txt"));
        command.args(["--json", "--quiet", "--work"]).arg(&arguments.folder).args(more);
        let (taken, said) = taken_by(&mut command)?;
        Ok((taken, serde_json::from_slice(&said)?))
    };
    // Once for the page cache.
    score(WAYS[1].1)?;
    println!("{} images of 640 x 480, one run, from the page cache; {}", arguments.images, circumstances());
    println!(
        "{:<14}{:>14}{:>9}{:>9}{:>9}{:>9}{:>9}{:>10}{:>14}",
        "", "returns cast", "wall s", "from", "to", "core s", "fuse s", "MiB", "DMP depth m²"
    );
    for (name, more) in WAYS {
        let mut rows = Vec::new();
        for _ in 0..arguments.runs {
            rows.push(score(more)?);
        }
        let [wall_s, from_s, to_s] = spread(rows.iter().map(|(taken, _)| taken.wall_s).collect());
        let [core_s, ..] = spread(rows.iter().map(|(taken, _)| taken.on_cores_s).collect());
        let (taken, report) = rows.first().context("one run at least")?;
        let number = |path: &str| report.pointer(path).and_then(Value::as_f64).unwrap_or(f64::NAN);
        println!(
            "{name:<14}{:>14}{wall_s:>9.1}{from_s:>9.1}{to_s:>9.1}{core_s:>9.1}{:>9.1}{:>10.0}{:>14.5}",
            number("/runs/0/returns"),
            number("/timing/fuse_s"),
            taken.peak_anon_bytes as f64 / (1u64 << 20) as f64,
            number("/runs/0/dmp_depth_mean_m2"),
        );
    }
    Ok(())
}
