//! Options that every subcommand has, and who runs it.

use clap::Args;

use crate::host::Hosted;

/// What every subcommand understands.
#[derive(Debug, Args)]
pub(crate) struct Common {
    /// Only errors on standard error
    #[arg(short, long, global = true)]
    pub(crate) quiet: bool,
    /// No progress bar (there is none either where standard error is not a terminal)
    #[arg(long, global = true)]
    pub(crate) no_progress: bool,
    #[arg(skip)]
    pub(crate) host: Hosted,
}
