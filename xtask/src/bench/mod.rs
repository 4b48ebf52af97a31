//! Benchmarks: what `docs/performance.md` tells comes from here.

mod cast;
mod city;
mod decode;
mod drift;
mod fuse;
mod laz;
mod loops;
mod quick;
mod rays;
mod reduce;
mod report;
mod room;
mod scale;
mod score;
mod shard;
mod simulate;
mod store;
mod taken;
mod times;
mod truth;

use clap::Subcommand;

pub(crate) use times::circumstances;

/// Measure the command on this machine
#[derive(Debug, Subcommand)]
pub(crate) enum Bench {
    Cast(Box<cast::CastArgs>),
    #[command(hide = true)]
    CastServe(cast::serve::ServeArgs),
    Decode(decode::DecodeArgs),
    Drift(drift::DriftArgs),
    Fuse(fuse::FuseArgs),
    Laz(laz::LazArgs),
    Loops(loops::LoopsArgs),
    Quick(quick::QuickArgs),
    Rays(rays::RaysArgs),
    #[command(hide = true)]
    RaysServe(rays::serve::ServeArgs),
    Reduce(reduce::ReduceArgs),
    Report(report::ReportArgs),
    Room(room::RoomArgs),
    Scale(scale::ScaleArgs),
    Score(score::ScoreArgs),
    Shard(shard::ShardArgs),
    Simulate(simulate::SimulateArgs),
    Store(store::StoreArgs),
    Truth(truth::TruthArgs),
}

pub(crate) fn run(bench: &Bench) -> anyhow::Result<()> {
    match bench {
        Bench::Cast(arguments) => cast::run(arguments),
        Bench::CastServe(arguments) => cast::serve::run(arguments),
        Bench::Decode(arguments) => decode::run(arguments),
        Bench::Drift(arguments) => drift::run(arguments),
        Bench::Laz(arguments) => laz::run(arguments),
        Bench::Loops(arguments) => loops::run(arguments),
        Bench::Quick(arguments) => quick::run(arguments),
        Bench::Rays(arguments) => rays::run(arguments),
        Bench::RaysServe(arguments) => rays::serve::run(arguments),
        Bench::Reduce(arguments) => reduce::run(arguments),
        Bench::Report(arguments) => report::run(arguments),
        Bench::Room(arguments) => room::run(arguments),
        Bench::Scale(arguments) => scale::run(arguments),
        Bench::Fuse(arguments) => fuse::run(arguments),
        Bench::Score(arguments) => score::run(arguments),
        Bench::Shard(arguments) => shard::run(arguments),
        Bench::Simulate(arguments) => simulate::run(arguments),
        Bench::Store(arguments) => store::run(arguments),
        Bench::Truth(arguments) => truth::run(arguments),
    }
}
