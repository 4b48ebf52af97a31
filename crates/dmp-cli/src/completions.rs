//! `dmp completions`: what a shell needs to complete the command line.

use std::io::Write;

use clap::{Args, Command};
use clap_complete::{Shell, generate};

use crate::exit::Exit;

/// Print what a shell needs to complete commands and options
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    dmp completions bash > ~/.local/share/bash-completion/completions/dmp\n  \
    dmp completions zsh > ~/.zfunc/_dmp\n  \
    dmp completions fish > ~/.config/fish/completions/dmp.fish")]
pub(crate) struct CompletionsArgs {
    /// The shell
    #[arg(value_enum, value_name = "SHELL")]
    shell: Shell,
}

/// Prints what completes `command`.
pub(crate) fn run(
    arguments: &CompletionsArgs,
    mut command: Command,
    out: &mut impl Write,
) -> anyhow::Result<Exit> {
    // It panics where it cannot write: a reader that goes away must not be met there.
    let mut script = Vec::new();
    generate(arguments.shell, &mut command, "dmp", &mut script);
    out.write_all(&script)?;
    Ok(Exit::Done)
}
