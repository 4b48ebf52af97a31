//! The project's own chores: `cargo xtask <task>`.

mod attack;
mod bench;
mod dist;
mod faults;
mod licences;
mod pictures;
mod samples;
mod site;
mod study;
mod trials;
mod workspace;
mod written;

use std::process::ExitCode;

use clap::Parser;

/// The project's own chores
#[derive(Debug, Parser)]
#[command(name = "cargo xtask")]
enum Task {
    Attack(attack::AttackArgs),
    #[command(subcommand)]
    Bench(bench::Bench),
    Dist(dist::DistArgs),
    Faults(faults::FaultsArgs),
    Licences(licences::LicencesArgs),
    Pictures(pictures::PicturesArgs),
    Samples(samples::SamplesArgs),
    Site(site::SiteArgs),
    Study(study::StudyArgs),
    Written(written::WrittenArgs),
}

fn main() -> ExitCode {
    let done = match Task::parse() {
        Task::Attack(arguments) => attack::run(&arguments),
        Task::Bench(bench) => bench::run(&bench),
        Task::Dist(arguments) => dist::run(&arguments),
        Task::Faults(arguments) => faults::run(&arguments),
        Task::Licences(arguments) => licences::run(&arguments),
        Task::Pictures(arguments) => pictures::run(&arguments),
        Task::Samples(arguments) => samples::run(&arguments),
        Task::Site(arguments) => site::run(&arguments),
        Task::Study(arguments) => study::run(&arguments),
        Task::Written(arguments) => written::run(&arguments),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}
