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

impl Task {
    fn run(&self) -> anyhow::Result<()> {
        match self {
            Self::Attack(arguments) => attack::run(arguments),
            Self::Bench(bench) => bench::run(bench),
            Self::Dist(arguments) => dist::run(arguments),
            Self::Faults(arguments) => faults::run(arguments),
            Self::Licences(arguments) => licences::run(arguments),
            Self::Pictures(arguments) => pictures::run(arguments),
            Self::Samples(arguments) => samples::run(arguments),
            Self::Site(arguments) => site::run(arguments),
            Self::Study(arguments) => study::run(arguments),
            Self::Written(arguments) => written::run(arguments),
        }
    }
}

fn main() -> ExitCode {
    match Task::parse().run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

/// What is committed and made by a task is what the task makes.
#[cfg(test)]
mod tests {
    use super::*;

    fn passes(task: &str) {
        let words = std::iter::once("xtask").chain(task.split(' '));
        Task::try_parse_from(words).unwrap().run().unwrap();
    }

    #[test]
    fn samples_are_current() {
        passes("samples --check");
    }

    #[test]
    fn the_picture_of_the_terminal_is_current() {
        // `cargo test --workspace` builds the command two folders above the tests.
        let tests = std::env::current_exe().unwrap();
        let binary = tests.ancestors().nth(2).unwrap().join("dmp");
        passes(&format!("pictures --check --binary {}", binary.display()));
    }

    /// Links, anchors, the table of contents, the number of words.
    #[test]
    fn pages_are_sound() {
        passes("site --check");
    }

    #[test]
    fn licences_are_current() {
        passes("licences --check");
    }
}
