//! The project's own caster as a process that casts on request, like those of `bench/peers/`.
//!
//! One line of input is one request: `go MODE` casts all rays once and answers with the seconds (`go build` builds
//! all trees instead), `ranges MODE FILE` writes the first ranges and answers `ok`, `rays FILE` goes over to some of
//! the rays and answers `ok`, `bytes` answers with the size of the trees. The end of input ends it.

use std::io::{BufRead as _, Write as _};
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::bail;
use clap::Args;

use super::files::{Files, Work};
use super::own::Own;
use super::records::write_numbers;

/// Cast on request: what `bench cast` starts
#[derive(Debug, Clone, Args)]
pub(crate) struct ServeArgs {
    surfels: PathBuf,
    rays: PathBuf,
    #[arg(requires = "segments")]
    support: Option<PathBuf>,
    segments: Option<PathBuf>,
}

pub(crate) fn run(arguments: &ServeArgs) -> anyhow::Result<()> {
    let ServeArgs { surfels, rays, support, segments } = arguments.clone();
    let segments = support.zip(segments).map(<[PathBuf; 2]>::from);
    let work = Work::read(&Files { name: String::new(), surfels, rays, segments })?;
    let start = Instant::now();
    let mut own = Own::new(work)?;
    let cut_s = start.elapsed().as_secs_f64();
    say(&format!(
        "ready {} surfels, {} rays, cut into {} tiles in {cut_s:.3} s",
        own.surfels(),
        own.rays(),
        own.tiles()
    ))?;
    for line in std::io::stdin().lock().lines() {
        say(&answer(&mut own, &line?)?)?;
    }
    Ok(())
}

fn answer(own: &mut Own, request: &str) -> anyhow::Result<String> {
    let (verb, rest) = request.split_once(' ').unwrap_or((request, ""));
    Ok(match (verb, rest.split_once(' ')) {
        ("go", None) if rest == "build" => own.build_s()?.to_string(),
        ("go", None) => own.cast_s(rest.parse()?)?.to_string(),
        ("ranges", Some((mode, path))) => {
            let [first_m, ..] = own.ranges(mode.parse()?)?;
            write_numbers(Path::new(path), first_m.iter().map(|&range_m| (range_m as f32).to_le_bytes()))?;
            "ok".to_owned()
        }
        ("rays", _) => {
            own.change_rays(Path::new(rest))?;
            "ok".to_owned()
        }
        ("bytes", None) => own.tile_bytes().to_string(),
        _ => bail!("{request}: unknown request"),
    })
}

fn say(line: &str) -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    writeln!(out, "{line}")?;
    Ok(out.flush()?)
}
