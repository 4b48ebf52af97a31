use clap::Args;

use crate::Exit;

/// Relative pose error of a trajectory against a reference, as evo_rpe
#[derive(Debug, Args)]
pub(crate) struct RpeArgs {}

pub(crate) fn run(_arguments: &RpeArgs, _out: &mut impl std::io::Write) -> anyhow::Result<Exit> {
    anyhow::bail!("not there yet")
}
