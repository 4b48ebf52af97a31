//! Options that every subcommand has, who runs it and who reads it.

use clap::{Args, ColorChoice};

use crate::host::Hosted;
use crate::terminal::Terminal;

/// What every subcommand understands.
#[derive(Debug, Default, Args)]
pub(crate) struct Common {
    /// Only errors on standard error
    #[arg(short, long, global = true)]
    pub(crate) quiet: bool,
    /// No progress bar (there is none either where standard error is not a terminal)
    #[arg(long, global = true)]
    pub(crate) no_progress: bool,
    /// Tables in colour; `auto`: where standard output is a terminal and the environment has no `NO_COLOR`
    #[arg(long, global = true, value_name = "WHEN", default_value_t = ColorChoice::Auto)]
    pub(crate) color: ColorChoice,
    #[arg(skip)]
    pub(crate) host: Hosted,
    #[arg(skip)]
    pub(crate) terminal: Terminal,
}
