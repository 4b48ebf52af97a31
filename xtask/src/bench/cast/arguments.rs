//! What the benchmark of the caster is asked for.

use std::path::PathBuf;

use clap::Args;

use super::scene::SceneArgs;

/// Rays into surfels: speed and exactness beside Embree and `open3d`
///
/// Scenes are read from a folder, or made of a simulated drive, or of a log; or the work is anyone's own.
#[derive(Debug, Args)]
pub(crate) struct CastArgs {
    /// Names of the scenes; dense, city and coarse are made where the folder has them not
    #[arg(default_values = ["dense", "city", "coarse"])]
    pub(super) scenes: Vec<String>,
    /// Folder of the scenes' files; without it they are not kept
    #[arg(long)]
    pub(super) folder: Option<PathBuf>,
    /// Only make the files of the scenes
    #[arg(long, requires = "folder")]
    pub(super) only_files: bool,
    #[command(flatten)]
    pub(super) making: SceneArgs,
    /// Surfels: little-endian f32, centre xyz, normal xyz, radius
    #[arg(long, requires = "rays", conflicts_with_all = ["folder", "scenes", "log"])]
    pub(super) surfels: Option<PathBuf>,
    /// Rays: little-endian f32, origin xyz, direction xyz, measured range
    #[arg(long, requires = "surfels")]
    pub(super) rays: Option<PathBuf>,
    /// Third lowest and third highest segment of each surfel, little-endian i32
    #[arg(long, requires_all = ["surfels", "segments"])]
    pub(super) support: Option<PathBuf>,
    /// Segment of each ray, little-endian i32
    #[arg(long, requires = "support")]
    pub(super) segments: Option<PathBuf>,
    /// Write the first range of each ray here, little-endian f32, NaN for a miss
    #[arg(long, requires = "surfels")]
    pub(super) ranges: Option<PathBuf>,
    /// Casts in each mode, in turns
    #[arg(long, default_value_t = 7, value_parser = clap::value_parser!(u32).range(1..))]
    pub(super) runs: u32,
    /// The core that everything on one thread runs on
    #[arg(long, default_value_t = 0)]
    pub(super) core: usize,
    /// A Python that has `open3d`
    #[arg(long, default_value = "python3")]
    pub(super) python: PathBuf,
    /// Options of `cast` of bench/peers/embree, in one word; once for each Embree to compare
    #[arg(long, default_values = ["", "--isa avx2"], allow_hyphen_values = true)]
    pub(super) embree: Vec<String>,
    /// Everything that Embree can do
    #[arg(long)]
    pub(super) all_modes: bool,
    /// Only casters and modes whose names, as in the table, contain this; no other tables then
    #[arg(long, default_value = "")]
    pub(super) only: String,
}
