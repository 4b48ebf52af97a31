use clap::Args;

use crate::{Common, Exit};

/// Every score of several runs beside ground truth, and how well they rank alike
#[derive(Debug, Args)]
pub(crate) struct StudyArgs {}

pub(crate) fn run(
    _arguments: &StudyArgs,
    _common: &Common,
    _out: &mut impl std::io::Write,
) -> anyhow::Result<Exit> {
    anyhow::bail!("not there yet")
}
