//! `dmp convert`: logs and trajectories in other formats.

mod log;
mod trajectory;

use clap::Subcommand;

use crate::common::Common;
use crate::exit::Exit;

/// Write a log or a trajectory in another format
#[derive(Debug, Subcommand)]
pub(crate) enum Convert {
    Log(Box<log::LogConvertArgs>),
    Trajectory(trajectory::TrajectoryConvertArgs),
}

impl Convert {
    pub(crate) fn run(&self, common: &Common, out: &mut impl std::io::Write) -> anyhow::Result<Exit> {
        match self {
            Self::Log(arguments) => log::run(arguments, common, out),
            Self::Trajectory(arguments) => trajectory::run(arguments, common, out),
        }
    }
}
