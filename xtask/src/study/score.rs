//! `cargo xtask study score`: score every drive, then print the tables.

use std::path::{Path, PathBuf};

use anyhow::Context as _;

use super::drives::{drives, find};
use super::evaluate::evaluate;
use super::result::DriveResult;
use super::tables;

/// Score the estimates of the drives and compare the verdicts with the truth
#[derive(Debug, clap::Args)]
pub(super) struct ScoreArgs {
    /// Only these drives, comma-separated [default: all]
    #[arg(long, value_delimiter = ',')]
    drives: Vec<String>,
    /// Folder for logs and results. A saved result is used again: remove DRIVE.json to score a drive again
    #[arg(long, default_value = "target/study", value_name = "FOLDER")]
    out: PathBuf,
    /// Score only every so many scans
    #[arg(long, value_name = "N", default_value_t = 1)]
    every: usize,
    /// Score nothing; print the tables of the saved results
    #[arg(long)]
    tables: bool,
}

pub(super) fn run(arguments: &ScoreArgs) -> anyhow::Result<()> {
    let ScoreArgs { drives: names, out, every, tables: tables_only } = arguments;
    std::fs::create_dir_all(out).with_context(|| out.display().to_string())?;
    let wanted = names.iter().map(|name| find(name)).collect::<anyhow::Result<Vec<_>>>()?;
    for spec in if names.is_empty() { drives() } else { wanted } {
        let path = path_of(out, spec.name, *every);
        if !tables_only && !path.exists() {
            let result = evaluate(&spec, out, *every)?;
            eprintln!("{}: {:.0} s", spec.name, result.seconds);
            std::fs::write(&path, serde_json::to_string(&result)?)
                .with_context(|| path.display().to_string())?;
        }
    }
    let saved = drives().into_iter().map(|spec| path_of(out, spec.name, *every)).filter(|path| path.exists());
    let results = saved.map(|path| read(&path)).collect::<anyhow::Result<Vec<_>>>()?;
    print!("{}", tables::all(&results.iter().collect::<Vec<_>>()));
    Ok(())
}

fn path_of(out: &Path, drive: &str, every: usize) -> PathBuf {
    out.join(if every == 1 { format!("{drive}.json") } else { format!("{drive}-every-{every}.json") })
}

fn read(path: &Path) -> anyhow::Result<DriveResult> {
    let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
    serde_json::from_str(&text).with_context(|| path.display().to_string())
}
