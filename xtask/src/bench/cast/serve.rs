//! The project's own caster as a process that casts on request, like those of `bench/peers/`.
//!
//! A line of input is a request: `go MODE` casts all rays once and answers with the seconds. The end of input ends it.

use std::io::Write as _;
use std::path::PathBuf;
use std::time::Instant;

use anyhow::Context as _;
use clap::Args;

use super::files::{Files, Work};
use super::own::Own;

/// Cast on request: `bench cast` starts this
#[derive(Debug, Clone, Args)]
pub(crate) struct ServeArgs {
    surfels: PathBuf,
    rays: PathBuf,
    support: PathBuf,
    segments: PathBuf,
}

pub(crate) fn run(arguments: &ServeArgs) -> anyhow::Result<()> {
    let ServeArgs { surfels, rays, support, segments } = arguments.clone();
    let work = Work::read(&Files { name: "work".to_owned(), surfels, rays, support, segments })?;
    let start = Instant::now();
    let mut own = Own::new(&work)?;
    let cut_s = start.elapsed().as_secs_f64();
    let (surfels, rays, tiles) = (work.surfels.len(), work.rays.len(), own.tiles());
    answer(&format!("ready {surfels} surfels, {rays} rays, cut into {tiles} tiles in {cut_s:.3} s"))?;
    for line in std::io::stdin().lines() {
        let line = line?;
        let mode = line.strip_prefix("go ").with_context(|| format!("{line}: unknown request"))?;
        answer(&own.cast(mode.parse()?)?.0.to_string())?;
    }
    Ok(())
}

fn answer(line: &str) -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    writeln!(out, "{line}")?;
    Ok(out.flush()?)
}
