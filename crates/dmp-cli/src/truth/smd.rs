use clap::Args;

use crate::{Common, Exit};

/// Surface distance of a map from a reference mesh or cloud
#[derive(Debug, Args)]
pub(crate) struct SmdArgs {}

pub(crate) fn run(
    _arguments: &SmdArgs,
    _common: &Common,
    _out: &mut impl std::io::Write,
) -> anyhow::Result<Exit> {
    anyhow::bail!("not there yet")
}
