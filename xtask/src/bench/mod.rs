//! Benchmarks: the tables of `docs/performance.md`.

mod cast;
mod scale;
mod score;
mod taken;
mod times;

use clap::Subcommand;

pub(crate) use times::circumstances;

/// Measure speed and memory on this machine
#[derive(Debug, Subcommand)]
pub(crate) enum Bench {
    Cast(Box<cast::CastArgs>),
    #[command(hide = true)]
    CastServe(cast::serve::ServeArgs),
    Scale(scale::ScaleArgs),
    Score(score::ScoreArgs),
}

pub(crate) fn run(bench: &Bench) -> anyhow::Result<()> {
    match bench {
        Bench::Cast(arguments) => cast::run(arguments),
        Bench::CastServe(arguments) => cast::serve::run(arguments),
        Bench::Scale(arguments) => scale::run(arguments),
        Bench::Score(arguments) => score::run(arguments),
    }
}
