//! `dmp simulate`: logs and trajectories with known truth.

mod city;
mod errors;
mod loops;
mod progress;
mod recording;
mod room;
mod town;

use clap::Subcommand;
use dmp_sim::SimError;

use crate::exit::Usage;
use crate::{Common, Exit};

/// Make logs and trajectories with known truth
#[derive(Debug, Subcommand)]
pub(crate) enum Simulate {
    Town(town::TownArgs),
    City(city::CityArgs),
    Room(room::RoomArgs),
    Errors(errors::ErrorsArgs),
    Loops(loops::LoopsArgs),
}

impl Simulate {
    pub(crate) fn run(&self, common: &Common, out: &mut impl std::io::Write) -> anyhow::Result<Exit> {
        match self {
            Self::Town(arguments) => town::run(arguments, common, out),
            Self::City(arguments) => city::run(arguments, common, out),
            Self::Room(arguments) => room::run(arguments, common, out),
            Self::Errors(arguments) => errors::run(arguments, common, out),
            Self::Loops(arguments) => loops::run(arguments, common, out),
        }
    }
}

/// A number out of range was given on the command line; whatever else is wrong is wrong with the run.
fn told(error: SimError) -> anyhow::Error {
    match error {
        SimError::OutOfRange { .. } => Usage(error.to_string()).into(),
        other => other.into(),
    }
}
