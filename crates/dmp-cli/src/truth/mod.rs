//! `dmp truth`: comparison with ground truth.

mod ape;
mod rpe;
mod smd;
mod study;

use clap::Subcommand;

use crate::{Common, Exit};

/// Compare with ground truth
#[derive(Debug, Subcommand)]
pub(crate) enum Truth {
    Ape(ape::ApeArgs),
    Rpe(rpe::RpeArgs),
    Smd(smd::SmdArgs),
    Study(Box<study::StudyArgs>),
}

impl Truth {
    pub(crate) fn run(&self, common: &Common, out: &mut impl std::io::Write) -> anyhow::Result<Exit> {
        match self {
            Self::Ape(arguments) => ape::run(arguments, out),
            Self::Rpe(arguments) => rpe::run(arguments, out),
            Self::Smd(arguments) => smd::run(arguments, common, out),
            Self::Study(arguments) => study::run(arguments, common, out),
        }
    }
}
