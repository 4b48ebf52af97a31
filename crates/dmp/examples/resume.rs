//! Stops half-way and resumes, with the same bits:
//! `cargo run --release -p dmp-slam --example resume -- [LOG RUN.tum RUN.tum ...]`.
//!
//! Here one process does both; after a crash or a power cut another process resumes in the same way.

use std::error::Error;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use dmp::prelude::*;

const SAMPLES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data-samples");

fn main() -> Result<(), Box<dyn Error>> {
    let mut files: Vec<String> = std::env::args().skip(1).collect();
    if files.is_empty() {
        files = ["town.mcap", "truth.tum", "drift.tum"].map(|file| format!("{SAMPLES}/{file}")).into();
    }
    let (log, trajectories) = files.split_first().ok_or("no log")?;
    let log = open_log(Path::new(log), &LogOptions::default())?;
    let runs = trajectories
        .iter()
        .map(|file| {
            let file = Path::new(file);
            let name = file.file_stem().unwrap_or_default().display().to_string();
            Ok(Run::new(name, read_trajectory(file)?.trajectory))
        })
        .collect::<Result<Vec<_>, Box<dyn Error>>>()?;

    // Checkpoints go to the work folder, here as often as possible; every minute suffices for a long log.
    let work_folder = std::env::temp_dir().join(format!("dmp-resume-{}", std::process::id()));
    std::fs::create_dir_all(&work_folder)?;
    let config = Config {
        work_folder: work_folder.clone(),
        checkpoint_every: Some(Duration::ZERO),
        resume: true,
        ..Config::default()
    };

    // Fusing and casting each read all returns once: one and a half times as many is half-way through casting.
    let half_way = StopAfter { most: log.summary().returns * 3 / 2, done: AtomicU64::new(0) };
    match evaluate(log.as_ref(), &runs, &config, &half_way) {
        Err(EvaluateError::Cancelled) => println!("stopped"),
        Ok(_) => return Err("it was done before it was stopped".into()),
        Err(error) => return Err(error.into()),
    }

    // Only a checkpoint of the same log, runs and settings is resumed. Nothing is left behind at the end.
    let resumed = evaluate(log.as_ref(), &runs, &config, &Noted)?;
    std::fs::remove_dir(&work_folder)?;

    let in_one_go = evaluate(log.as_ref(), &runs, &Config::default(), ())?;
    assert_eq!((&resumed.runs, &resumed.pairs), (&in_one_go.runs, &in_one_go.pairs));
    println!("order: {}; the same bits as in one go", resumed.order.join(", "));
    Ok(())
}

/// Requests a stop after a number of returns.
struct StopAfter {
    most: u64,
    done: AtomicU64,
}

impl Progress for StopAfter {
    fn advance(&self, amount: u64) {
        self.done.fetch_add(amount, Ordering::Relaxed);
    }

    fn note(&self, note: &Note) {
        println!("{note}");
    }

    fn cancelled(&self) -> bool {
        self.done.load(Ordering::Relaxed) > self.most
    }
}

/// Prints notes during the evaluation.
struct Noted;

impl Progress for Noted {
    fn note(&self, note: &Note) {
        println!("{note}");
    }
}
