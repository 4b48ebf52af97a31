//! `dmp completions`: scripts that complete the command line.

use std::io::Write as _;

use clap_complete::generate;

use crate::console::{Common, Exit};
use crate::options::{Asked, Out, Spec, tools};

pub(crate) static SPEC: Spec = Spec {
    name: "completions",
    about: "Print the script with which a shell completes commands and options",
    after: "Examples:\n  \
            dmp completions bash > ~/.local/share/bash-completion/completions/dmp\n  \
            dmp completions zsh > ~/.zfunc/_dmp\n  \
            dmp completions fish > ~/.config/fish/completions/dmp.fish",
    options: &[&[&tools::SHELL]],
    run,
    ..Spec::EMPTY
};

fn run(asked: &Asked, _: &Common, out: &mut Out<'_>) -> anyhow::Result<Exit> {
    // It panics where it cannot write, so it does not write to a pipe.
    let mut script = Vec::new();
    generate(asked.need(&tools::SHELL)?, &mut asked.program(), "dmp", &mut script);
    out.write_all(&script)?;
    Ok(Exit::Done)
}
