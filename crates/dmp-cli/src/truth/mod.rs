//! `dmp truth`: comparison with ground truth.

mod ape;
mod compare;
mod compare_args;
mod compared;
mod plot;
mod results_zip;
mod rpe;
mod smd;
mod told;

use clap::Subcommand;

use crate::common::Common;
use crate::exit::Exit;

/// Compare with ground truth
#[derive(Debug, Subcommand)]
pub(crate) enum Truth {
    Ape(ape::ApeArgs),
    Rpe(rpe::RpeArgs),
    Smd(Box<smd::SmdArgs>),
}

impl Truth {
    pub(crate) fn run(&self, common: &Common, out: &mut impl std::io::Write) -> anyhow::Result<Exit> {
        match self {
            Self::Ape(arguments) => ape::run(arguments, common, out),
            Self::Rpe(arguments) => rpe::run(arguments, common, out),
            Self::Smd(arguments) => smd::run(arguments, common, out),
        }
    }
}
