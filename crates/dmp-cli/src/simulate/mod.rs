//! `dmp simulate`: logs and trajectories with known truth.

mod city;
mod errors;
mod fault;
mod loops;
mod progress;
mod recording;
mod room;
mod town;

use clap::Subcommand;

use crate::common::Common;
use crate::exit::Exit;

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
