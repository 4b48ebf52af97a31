//! `dmp map`: surfel maps on disk.

mod build;
mod export;
mod info;
mod verify;

use clap::Subcommand;

use crate::common::Common;
use crate::exit::Exit;

/// Build, look at, check and export surfel maps (.dmpmap)
#[derive(Debug, Subcommand)]
pub(crate) enum Map {
    Build(Box<build::BuildArgs>),
    Info(info::MapInfoArgs),
    Verify(verify::VerifyArgs),
    Export(export::ExportArgs),
}

impl Map {
    pub(crate) fn run(&self, common: &Common, out: &mut impl std::io::Write) -> anyhow::Result<Exit> {
        match self {
            Self::Build(arguments) => build::run(arguments, common, out),
            Self::Info(arguments) => info::run(arguments, out),
            Self::Verify(arguments) => verify::run(arguments, common, out),
            Self::Export(arguments) => export::run(arguments, common, out),
        }
    }
}
