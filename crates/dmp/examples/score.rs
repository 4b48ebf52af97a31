//! Scores runs of one log and prints which made the better map, by default of the samples:
//! `cargo run --release -p dmp-slam --example score -- [LOG RUN.tum [RUN.tum ...]]`.

use std::error::Error;
use std::path::Path;

use dmp::prelude::*;

const SAMPLES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data-samples");

fn main() -> Result<(), Box<dyn Error>> {
    let mut files: Vec<String> = std::env::args().skip(1).collect();
    if files.is_empty() {
        files = ["town.mcap", "noise.tum", "truth.tum", "drift.tum"].map(|f| format!("{SAMPLES}/{f}")).into();
    }
    let (log, trajectories) = files.split_first().ok_or("no log")?;

    // The format is detected: MCAP, rosbag2, a folder of scans or of depth images, LAS.
    let log = open_log(Path::new(log), &LogOptions::default())?;
    // A run is a trajectory of that log. Its map is fused from the scans; to score a given map, set `Run::map`.
    let runs = trajectories
        .iter()
        .map(|file| {
            let file = Path::new(file);
            let name = file.file_stem().unwrap_or_default().display().to_string();
            Ok(Run::new(name, read_trajectory(file)?.trajectory))
        })
        .collect::<Result<Vec<_>, Box<dyn Error>>>()?;

    let report = evaluate(log.as_ref(), &runs, &Config::default(), ())?;

    // Root mean squares of measured minus predicted range, truncated at several lengths: less is better.
    let basis = report.leading_basis();
    println!("{} returns, voxel {:.2} m", report.inputs.returns_used, report.config.voxel_m);
    for (rank, run) in report.ranked() {
        // No rank if it is not decided to be worse than the run above.
        let rank = rank.map_or(String::new(), |rank| rank.to_string());
        print!("{rank:>2} {:10}", run.name);
        for (scale_m, score_m2) in run.scores(basis).iter() {
            match score_m2 {
                Some(m2) => print!("  {basis}({scale_m} m) {:.3} m", m2.sqrt()),
                None => print!("  {basis}({scale_m} m) unknown"),
            }
        }
        println!();
    }

    // Whether the difference of two runs is significant, and at which scale.
    if let [one, other, ..] = runs.as_slice()
        && let Some(verdict) = report.verdict_between(&one.name, &other.name)
    {
        let outcome = match verdict {
            Verdict::Better { run, decided_at_m: Some(at_m) } => {
                format!("{run} is better, decided at {at_m} m")
            }
            Verdict::Better { run, .. } => format!("{run} is better: it drifts less"),
            Verdict::Mixed { run, .. } => format!("{run} is better on the whole, but not everywhere"),
            Verdict::Same => format!("{} and {} are as good", one.name, other.name),
            Verdict::Undecided => format!("{} and {} are undecided", one.name, other.name),
        };
        println!("{outcome}");
    }
    for warning in &report.warnings {
        println!("warning: {warning}");
    }
    Ok(())
}
