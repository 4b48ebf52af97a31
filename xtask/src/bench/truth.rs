//! How fast runs are compared with ground truth.

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::Args;

use super::times::{circumstances, seconds, spread};

/// `dmp truth ape` and `rpe` beside evo's commands, where they are installed
#[derive(Debug, Args)]
pub(crate) struct TruthArgs {
    /// Poses of each trajectory
    #[arg(long, default_value_t = 200_000)]
    poses: usize,
    /// Runs of each command, interleaved
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..))]
    runs: u32,
    /// The command, built in release
    #[arg(long, default_value = "target/release/dmp")]
    dmp: PathBuf,
    /// Folder of `evo_ape` and `evo_rpe`, if they are not on the path
    #[arg(long)]
    evo: Option<PathBuf>,
}

pub(crate) fn run(arguments: &TruthArgs) -> anyhow::Result<()> {
    let folder = tempfile::tempdir()?;
    let [reference, estimate] = ["reference.tum", "estimate.tum"].map(|name| folder.path().join(name));
    std::fs::write(&reference, trajectory(arguments.poses, 0.0))?;
    std::fs::write(&estimate, trajectory(arguments.poses, 0.05))?;
    println!("{} poses, {} runs of each, interleaved; {}", arguments.poses, arguments.runs, circumstances());
    println!("{:<40}{:>12}{:>22}", "command", "median s", "least – largest s");
    for (metric, options) in [("ape", &["-a"][..]), ("rpe", &["-d", "100", "-u", "m"])] {
        let files = ["tum".into(), reference.display().to_string(), estimate.display().to_string()];
        let with = |start: Vec<String>| -> Vec<String> {
            start.into_iter().chain(files.clone()).chain(options.iter().map(|o| (*o).to_owned())).collect()
        };
        let ours = with(vec![arguments.dmp.display().to_string(), "truth".into(), metric.into()]);
        let evo = format!("evo_{metric}");
        let evo_path =
            arguments.evo.as_deref().map_or_else(|| PathBuf::from(&evo), |folder| folder.join(&evo));
        let theirs = with(vec![evo_path.display().to_string()]);
        // One of each before the clock counts: files in memory, evo's settings written.
        seconds(&ours)?;
        let evo_is_there = seconds(&theirs).inspect_err(|error| println!("without evo: {error}")).is_ok();
        let (mut ours_s, mut theirs_s) = (Vec::new(), Vec::new());
        for _ in 0..arguments.runs {
            ours_s.push(seconds(&ours)?);
            if evo_is_there {
                theirs_s.push(seconds(&theirs)?);
            }
        }
        let shown = |start: &str| format!("{start} tum REF EST {}", options.join(" "));
        let ours_s = told(&shown(&format!("dmp truth {metric}")), ours_s);
        if evo_is_there {
            let theirs_s = told(&shown(&evo), theirs_s);
            println!("{:<40}{:>11.1}x", "ratio of the medians", theirs_s / ours_s);
        }
    }
    Ok(())
}

/// Prints a row of times and says their median.
fn told(command: &str, times_s: Vec<f64>) -> f64 {
    let [median, least, largest] = spread(times_s);
    println!("{command:<40}{median:>12.3}{:>22}", format!("{least:.3} – {largest:.3}"));
    median
}

/// A winding drive in TUM format, a pose each 10 ms, every place off by up to `noise_m`.
fn trajectory(poses: usize, noise_m: f64) -> String {
    let mut state = 1_u64;
    let mut off_m = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        noise_m * ((state >> 11) as f64 / (1_u64 << 53) as f64 * 2.0 - 1.0)
    };
    let mut text = String::new();
    for k in 0..poses {
        let t = k as f64 * 0.01;
        let half_yaw = 0.5 * (0.05 * t).sin() + 0.01 * t;
        let place = [8.0 * t + off_m(), 50.0 * (0.02 * t).sin() + off_m(), (0.1 * t).cos() + off_m()];
        let _ = writeln!(
            text,
            "{:.6} {:.6} {:.6} {:.6} 0 0 {:.9} {:.9}",
            1_600_000_000.0 + t,
            place[0],
            place[1],
            place[2],
            half_yaw.sin(),
            half_yaw.cos()
        );
    }
    text
}
