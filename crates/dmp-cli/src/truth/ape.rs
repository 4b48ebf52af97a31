use clap::Args;

use crate::Exit;

/// Absolute pose error of a trajectory against a reference, as evo_ape
#[derive(Debug, Args)]
pub(crate) struct ApeArgs {}

pub(crate) fn run(_arguments: &ApeArgs, _out: &mut impl std::io::Write) -> anyhow::Result<Exit> {
    anyhow::bail!("not there yet")
}
