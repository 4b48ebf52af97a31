//! The site: `docs/` as a book, with its links, its table of contents and the length of its pages checked.

mod build;
mod check;
mod markdown;

use anyhow::bail;
use clap::Args;

/// Check the pages of `docs/`, and make the site of them with mdbook, in `target/site`
#[derive(Debug, Args)]
pub(crate) struct SiteArgs {
    /// Only check: links, anchors, the table of contents, the length of pages
    #[arg(long)]
    check: bool,
}

pub(crate) fn run(arguments: &SiteArgs) -> anyhow::Result<()> {
    let root = crate::workspace::root();
    let found = check::problems(&root)?;
    if !found.is_empty() {
        bail!("the pages are not as they should be:\n{}", found.join("\n"));
    }
    if arguments.check { Ok(()) } else { build::build(&root) }
}
