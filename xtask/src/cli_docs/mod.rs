//! `docs/cli.md`, made from the definition that `--help` is made from.

mod markdown;
mod page;

use std::fs;

use anyhow::{Context as _, bail};
use clap::Args;

/// Write `docs/cli.md`: every command and option, as `--help` has them
#[derive(Debug, Args)]
pub(crate) struct CliDocsArgs {
    /// Only compare: fail where the page is not what would be written
    #[arg(long)]
    check: bool,
}

pub(crate) fn run(arguments: &CliDocsArgs) -> anyhow::Result<()> {
    let path = crate::workspace::root().join("docs/cli.md");
    let made = page::page(dmp_cli::command());
    if !arguments.check {
        return fs::write(&path, made).with_context(|| format!("{}: cannot write", path.display()));
    }
    let kept = fs::read_to_string(&path).with_context(|| format!("{}: cannot read", path.display()))?;
    if let Some(line) = first_difference(&kept, &made) {
        bail!(
            "{} is not what --help says today, from line {line} on: run `cargo xtask cli-docs` and commit it",
            path.display()
        );
    }
    Ok(())
}

/// The first line, counted from 1, in which two texts differ.
fn first_difference(a: &str, b: &str) -> Option<usize> {
    let same = a.split('\n').zip(b.split('\n')).take_while(|(a, b)| a == b).count();
    (a != b).then_some(same + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_line_that_differs_is_named() {
        assert_eq!(first_difference("a\nb\n", "a\nb\n"), None);
        assert_eq!(first_difference("a\nb\n", "a\nc\n"), Some(2));
        assert_eq!(first_difference("a\nb\n", "a\nb\nc\n"), Some(3));
        assert_eq!(first_difference("", "a\n"), Some(1));
    }
}
