//! Scores runs from Rust: `cargo run --release -p dmp --example score -- LOG RUN.tum [RUN.tum ...]`.

use dmp::{Config, Run, evaluate};
use dmp_log::{LogOptions, open_log, read_trajectory};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let log = open_log(arguments.next().ok_or("no log")?.as_ref(), &LogOptions::default())?;
    let runs = arguments
        .map(|file| Ok(Run::new(file.as_str(), read_trajectory(file.as_ref())?.trajectory)))
        .collect::<Result<Vec<_>, dmp_log::LogError>>()?;
    let report = evaluate(log.as_ref(), &runs, &Config::default(), ())?;
    println!("voxel {:.3} m, order: {}", report.config.voxel_m, report.order.join(", "));
    for pair in &report.pairs {
        println!("{} against {}: {} ({})", pair.a, pair.b, pair.verdict, pair.reason);
    }
    Ok(())
}
