//! Rays from arrays of numpy beside rays from Rust: the same ones, into the same map.

mod make;
mod npy;
pub(crate) mod serve;

use std::path::PathBuf;
use std::process::Command;

use anyhow::{Context as _, ensure};
use clap::Args;

use self::make::{Files, SceneArgs};
use super::times::circumstances;
use crate::workspace::root;

/// Rays from numpy: the Python package beside the caster in Rust, and casters of others
///
/// Makes a map and rays of a simulated drive as files, and hands them to python/bench/rays.py, which casts them in turns.
#[derive(Debug, Args)]
pub(crate) struct RaysArgs {
    /// Folder of the map and the rays, made where they are not there; without it they are not kept
    #[arg(long)]
    folder: Option<PathBuf>,
    /// Only make the files
    #[arg(long, requires = "folder")]
    only_files: bool,
    #[command(flatten)]
    scene: SceneArgs,
    /// A Python with `dmp_slam`; `open3d`, `trimesh` and `embreex` take part where it has them
    #[arg(long, default_value = "python3")]
    python: PathBuf,
    /// Casts in each way, in turns
    #[arg(long, default_value_t = 7, value_parser = clap::value_parser!(u32).range(5..))]
    runs: u32,
    /// Only casters whose names contain this, beside the one in Rust
    #[arg(long, default_value = "")]
    only: String,
}

pub(crate) fn run(arguments: &RaysArgs) -> anyhow::Result<()> {
    let kept_nowhere = tempfile::tempdir_in("/var/tmp")?;
    let files = Files::of(arguments.folder.as_deref().unwrap_or(kept_nowhere.path()));
    if !files.are_there() {
        println!("{}", make::make(&arguments.scene, &files)?);
    }
    if arguments.only_files {
        return Ok(());
    }
    println!("{} casts in each way, in turns; {}", arguments.runs, circumstances());
    let mut command = Command::new(&arguments.python);
    command.arg(root().join("python/bench/rays.py")).arg(&files.folder);
    command.arg("--rust").arg(std::env::current_exe()?);
    command.args(["--runs", &arguments.runs.to_string(), "--only", &arguments.only]);
    let status = command.status().with_context(|| format!("{}: cannot start", arguments.python.display()))?;
    ensure!(status.success(), "{}: {status}", arguments.python.display());
    Ok(())
}
