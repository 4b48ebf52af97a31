//! `cargo xtask bench cast`: speed and exactness of the caster beside Embree and `open3d`, on the same work.

mod exact;
mod files;
mod own;
mod peers;
mod scene;
pub(super) mod serve;
mod speeds;

use std::path::PathBuf;

use clap::Args;

use self::exact::Exact;
use self::files::{Files, Work};
use self::own::Own;
use self::scene::SceneArgs;
use self::speeds::Casters;
use super::times::circumstances;

/// Cast rays into surfels: speed and exactness beside Embree and `open3d`
///
/// Scenes are read from a folder, or made from a simulated drive or a log.
#[derive(Debug, Args)]
pub(crate) struct CastArgs {
    /// Names of the scenes; dense, city and coarse are made where their files are missing
    #[arg(default_values = ["dense", "city", "coarse"])]
    scenes: Vec<String>,
    /// Folder of the scenes' files [default: a temporary folder]
    #[arg(long)]
    folder: Option<PathBuf>,
    #[command(flatten)]
    making: SceneArgs,
    /// Casts in each mode, in turns
    #[arg(long, default_value_t = 7, value_parser = clap::value_parser!(u32).range(1..))]
    runs: u32,
    /// The core that all casters run on
    #[arg(long, default_value_t = 0)]
    core: usize,
    /// A Python that has `open3d`
    #[arg(long, default_value = "python3")]
    python: PathBuf,
    /// Options of `cast` of bench/peers/embree, as one word; once for each Embree to compare
    #[arg(long, default_values = ["", "--isa avx2"], allow_hyphen_values = true)]
    embree: Vec<String>,
}

pub(crate) fn run(arguments: &CastArgs) -> anyhow::Result<()> {
    println!(
        "one thread on core {}, {} casts in each mode, in turns; {}",
        arguments.core,
        arguments.runs,
        circumstances()
    );
    let temporary = tempfile::tempdir_in("/var/tmp")?;
    let folder = arguments.folder.as_deref().unwrap_or(temporary.path());
    for files in scene::files(&arguments.making, folder, &arguments.scenes)? {
        measure(arguments, &files)?;
    }
    Ok(())
}

fn measure(arguments: &CastArgs, files: &Files) -> anyhow::Result<()> {
    let work = Work::read(files)?;
    println!("\n{}: {} surfels, {} rays", files.name, work.surfels.len(), work.rays.len());
    let mut casters = Casters::start(&arguments.embree, &arguments.python, arguments.core, files);
    match Exact::of(files) {
        Ok(exact) => exact.print(&mut Own::new(&work)?, &work, &mut casters.peers)?,
        Err(error) => println!("{}: without exact ranges: {error:#}", files.name),
    }
    println!();
    casters.measure(arguments.runs)?;
    casters.print();
    Ok(())
}
