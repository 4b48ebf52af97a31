//! The options of `dmp truth smd`.

use std::path::PathBuf;

use clap::Args;
use dmp::Config;
use dmp_log::PointTime;
use dmp_truth::surface::SurfaceSettings;

use crate::extrinsic::Extrinsic;
use crate::named::Named;
use crate::named::NamedFile;
use crate::parse::length_m;
use crate::score::parse;

/// Surface distance of a map from a reference mesh or cloud
///
/// Measures from every point of the map to the nearest place of the reference (accuracy: the mean of these is
/// the surface mean distance) and from the reference to the nearest point of the map (completeness). What the
/// map never saw counts as incomplete; see --crop. Both may be larger than memory; of a mesh the vertices are
/// held.
#[derive(Debug, Args)]
#[command(
    override_usage = "dmp truth smd [OPTIONS] REFERENCE MAP\n       \
    dmp truth smd [OPTIONS] REFERENCE LOG -t [NAME=]RUN.tum ...",
    after_help = "Examples:\n  \
    dmp truth smd survey.ply map.laz\n  \
    dmp truth smd survey.laz run.dmpmap --thin 0.05 --crop --json\n  \
    dmp truth smd survey.laz map.ply --align truth.tum run.tum\n  \
    dmp truth smd town.obj drive.mcap -t runs/a.tum -t runs/b.tum --align truth.tum"
)]
pub(crate) struct SmdArgs {
    /// The reference: a mesh (PLY with faces, OBJ) or a cloud (LAS, LAZ, PLY), metres
    pub(super) reference: PathBuf,
    /// What is measured: a cloud (LAS, LAZ, PLY) or a saved map (.dmpmap); with -t the log that the runs' maps
    /// are fused from
    #[arg(value_name = "MAP|LOG")]
    pub(super) map: PathBuf,
    /// A run of the log whose map is measured: TUM format or KITTI rows
    #[arg(short = 't', long = "trajectory", value_name = "[NAME=]RUN", help_heading = "Input")]
    pub(super) trajectories: Vec<NamedFile>,
    /// More runs: what a shell makes of `-t runs/*.tum`
    #[arg(value_name = "[NAME=]RUN", hide = true)]
    pub(super) more: Vec<NamedFile>,
    /// Move the map as its trajectory is best moved onto the reference's: REFERENCE.tum ESTIMATE.tum, or with
    /// -t only REFERENCE.tum. Rigid, by the least squares of places at common stamps. After the files
    #[arg(long, value_names = ["REFERENCE", "ESTIMATE"], num_args = 1..=2, help_heading = "Input")]
    pub(super) align: Vec<PathBuf>,

    /// A distance beyond this counts as this, metres
    #[arg(long, value_name = "METRES", default_value = "1", value_parser = length_m, help_heading = "Measure")]
    cap: f64,
    /// Lengths at which accuracy and completeness are given, metres [those of 0.05,0.1,0.2,0.5 within the cap]
    #[arg(long, value_name = "METRES,...", value_delimiter = ',', value_parser = length_m)]
    #[arg(help_heading = "Measure")]
    thresholds: Option<Vec<f64>>,
    /// Count one point of each voxel of this edge, metres, on both sides, so that density does not weigh
    /// [default: every point counts, as in other tools]
    #[arg(long, value_name = "METRES", value_parser = length_m, help_heading = "Measure")]
    thin: Option<f64>,
    /// Only ask for the reference within the cap of the map's bounding box
    #[arg(long, help_heading = "Measure")]
    crop: bool,
    /// A mesh is sampled once for each square of this edge, metres, for its completeness
    #[arg(long, value_name = "METRES", default_value = "0.1", value_parser = length_m, help_heading = "Measure")]
    spacing: f64,

    /// The topic with the scans, where the log has several
    #[arg(long, value_name = "NAME", help_heading = "Maps fused from a log")]
    pub(super) topic: Option<String>,
    /// Times of points, as for dmp score
    #[arg(long, value_name = "UNIT", default_value = "auto", help_heading = "Maps fused from a log")]
    pub(super) point_time: PointTime,
    /// Use only every N-th scan
    #[arg(long, value_name = "N", default_value_t = 1, help_heading = "Maps fused from a log")]
    every: usize,
    /// Where the sensor sits on the body that the trajectories move, as for dmp score
    #[arg(long, value_name = "[NAME=]EXTRINSIC")]
    #[arg(allow_hyphen_values = true, help_heading = "Maps fused from a log")]
    pub(super) extrinsic: Vec<Named<Extrinsic>>,
    /// Edge of a voxel, metres; `auto` takes 0.2, 0.3 or 0.5 m by the density of the scans, of a
    /// depth camera 0.02, 0.03 or 0.05 m
    #[arg(long, value_name = "METRES", default_value = "auto", help_heading = "Maps fused from a log")]
    voxel: parse::AutoLength,

    /// Memory to aim for, as 2GiB or 500MB, or `unlimited`; what does not fit goes to --work [default: a quarter
    /// of the machine's]
    #[arg(long, value_name = "SIZE", value_parser = parse::memory_bytes, help_heading = "Resources")]
    memory: Option<usize>,
    /// Threads [default: one for each core]
    #[arg(long, value_name = "N", help_heading = "Resources")]
    threads: Option<usize>,
    /// Folder for scratch files [default: the system's for such files]
    #[arg(long, value_name = "FOLDER", help_heading = "Resources")]
    work: Option<PathBuf>,
    /// Print one JSON object (schema dmp-smd/1) instead of a table
    #[arg(long, help_heading = "Output")]
    pub(super) json: bool,
}

impl SmdArgs {
    pub(super) fn config(&self) -> Config {
        let default = Config::default();
        let quarter = || dmp::machine_memory_bytes().map(|bytes| (bytes / 4) as usize);
        Config {
            voxel_m: self.voxel.0,
            every: self.every,
            memory_bytes: self.memory.or_else(quarter).unwrap_or(default.memory_bytes),
            threads: self.threads.unwrap_or(default.threads),
            work_folder: self.work.clone().unwrap_or(default.work_folder.clone()),
            ..default
        }
    }

    pub(super) fn settings(&self, config: &Config) -> SurfaceSettings {
        let default = SurfaceSettings::default();
        let within_cap = || default.thresholds_m.iter().copied().filter(|&t| t <= self.cap).collect();
        SurfaceSettings {
            cap_m: self.cap,
            thresholds_m: self.thresholds.clone().unwrap_or_else(within_cap),
            thin_m: self.thin,
            crop: self.crop,
            spacing_m: self.spacing,
            memory_bytes: config.memory_bytes,
            threads: config.threads,
            work_folder: config.work_folder.clone(),
            ..default
        }
    }
}
