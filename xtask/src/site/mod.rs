//! The site: `docs/` and generated pages as a book. Links, table of contents and length of pages are checked.

mod build;
mod check;
mod generated;
mod markdown;

use anyhow::bail;
use clap::Args;

/// Check the pages of `docs/` and build the site with mdbook in `target/site`
///
/// Two pages are generated: cli.md with the help of every command, files.md with the first sentence of every source file.
#[derive(Debug, Args)]
pub(crate) struct SiteArgs {
    /// Only check links, anchors, the table of contents and the length of pages
    #[arg(long)]
    check: bool,
}

pub(crate) fn run(arguments: &SiteArgs) -> anyhow::Result<()> {
    let root = crate::workspace::root();
    let found = check::problems(&root)?;
    if !found.is_empty() {
        bail!("problems in the pages:\n{}", found.join("\n"));
    }
    if arguments.check { Ok(()) } else { build::build(&root) }
}
