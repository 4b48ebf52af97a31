//! Queries a saved report, the output of `dmp score --json`; without one, scores the samples first:
//! `cargo run --release -p dmp-slam --example verdicts -- [REPORT.json]`.

use std::error::Error;
use std::fs;
use std::path::Path;

use dmp::prelude::*;

const SAMPLES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data-samples");

fn main() -> Result<(), Box<dyn Error>> {
    let json = match std::env::args().nth(1) {
        Some(file) => fs::read_to_string(file)?,
        // serde writes a report in the same form.
        None => serde_json::to_string_pretty(&score_samples()?)?,
    };
    let report: Report = serde_json::from_str(&json)?;

    // The best run is decided to be better than every other; else several runs may be the best.
    match report.best() {
        Some(Best::Run(run)) => println!("best: {}", run.name),
        Some(Best::Tie(runs)) => {
            let names: Vec<&str> = runs.iter().map(|run| run.name.as_str()).collect();
            println!("best: one of {}", names.join(", "));
        }
        None => println!("no run was scored"),
    }

    // Every run against the first of the order.
    let (first, others) = report.order.split_first().ok_or("no runs")?;
    for other in others {
        let Some(pair) = report.pair(first, other) else { continue };
        println!("{first} and {other}: {} ({})", pair.verdict, pair.reason);
        if let Some(scale) = pair.decided_at()
            && let Some([low, high]) = scale.interval_m2
        {
            println!("  {} less {} at {} m: {low:.3} to {high:.3} m²", pair.a, pair.b, scale.scale_m);
        }
    }
    // The same as one yes-or-no question, as in a regression test.
    let is_worse =
        |new: &str, old: &str| report.verdict_between(new, old).and_then(Verdict::better) == Some(old);
    println!("is any run worse than {first}: {}", others.iter().any(|other| is_worse(other, first)));

    // A score by name, basis and length; `None` if the report does not have it.
    if let Some(m2) = report.score_of(first, report.leading_basis(), 0.5) {
        println!("{first} at 0.5 m: {:.1} cm", 100.0 * m2.sqrt());
    }

    // Warnings that limit the results: of all runs, and of each.
    let of_runs = report.runs.iter().flat_map(|run| run.warnings.iter().map(move |w| (run.name.as_str(), w)));
    for (whose, warning) in report.warnings.iter().map(|warning| ("all runs", warning)).chain(of_runs) {
        println!("warning, {whose}: {warning}");
    }
    Ok(())
}

/// The report of the sample log.
fn score_samples() -> Result<Report, Box<dyn Error>> {
    let samples = Path::new(SAMPLES);
    let log = open_log(&samples.join("town.mcap"), &LogOptions::default())?;
    let mut runs = Vec::new();
    for name in ["truth", "drift", "collapsed"] {
        let file = samples.join(name).with_extension("tum");
        runs.push(Run::new(name, read_trajectory(&file)?.trajectory));
    }
    Ok(evaluate(log.as_ref(), &runs, &Config::default(), ())?)
}
