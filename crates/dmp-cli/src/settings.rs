//! How runs are scored: what `dmp score` and `dmp truth study` have in common.

use std::path::{Path, PathBuf};

use clap::Args;
use dmp::{Config, Ego, MissPrice, Scales};

use crate::clock_args::ClockArgs;
use crate::extrinsic::{self, Extrinsic};
use crate::log_args::Mapper;
use crate::named::Named;
use crate::score::parse;

/// How returns become a score.
#[derive(Debug, Args)]
pub(crate) struct SettingsArgs {
    #[command(flatten)]
    pub(crate) scans: ScanArgs,
    #[command(flatten)]
    pub(crate) clock: ClockArgs,
    /// Length of a segment of the drive, as `12m`, `2s` or `30scans`: a return is not compared with what was seen in
    /// its own segment and the two beside it. `auto` is 12 m, or a sixteenth of a shorter drive; in a room a sixteenth
    /// of the scans
    #[arg(long, value_name = "LENGTH", default_value = "auto", help_heading = "Returns and map")]
    segment: parse::AutoSegment,
    /// Keep returns on the trails of moving objects out of all maps: those whose surfels are passed through by
    /// rays of other parts of the drive. Reads the log four times instead of twice; not with --map
    #[arg(long, help_heading = "Returns and map")]
    free_space: bool,
    /// For fused maps: what a return that other parts of the drive do not predict costs at the largest scale, as
    /// a share of the full square, 100 m² on a drive: from 0 to 1, to the thousandth
    #[arg(long, value_name = "SHARE", default_value_t = Config::default().miss_price, value_parser = parse::miss_price)]
    #[arg(allow_hyphen_values = true, help_heading = "Returns and map")]
    miss_price: MissPrice,
    /// The sensor's noise, metres: scales the raw log-likelihood, nothing else [default: 0.02; of a depth camera
    /// 0.0012 + 0.0019 (z - 0.4)² at the depth z]
    #[arg(long, value_name = "METRES", value_parser = crate::parse::length_m, help_heading = "Returns and map")]
    sigma: Option<f64>,
    #[command(flatten)]
    pub(crate) resources: ResourceArgs,
}

/// Which returns are used, and where they were measured.
#[derive(Debug, Args)]
pub(crate) struct ScanArgs {
    /// Use only every N-th scan, for the map and for the score
    #[arg(long, value_name = "N", default_value_t = 1, help_heading = "Input")]
    every: usize,
    #[command(flatten)]
    pub(crate) place: PlaceArgs,
    /// Edge of a voxel, metres; `auto` takes 0.2, 0.3 or 0.5 m by the density of the scans, in a room 0.02, 0.03 or
    /// 0.05 m
    #[arg(long, value_name = "METRES", default_value = "auto", help_heading = "Returns and map")]
    voxel: parse::AutoLength,
}

/// Where returns were measured, and which of them are used.
#[derive(Debug, Args)]
pub(crate) struct PlaceArgs {
    #[arg(long, value_name = "[NAME=]EXTRINSIC", help = extrinsic::HELP)]
    #[arg(allow_hyphen_values = true, help_heading = "Place and time")]
    pub(crate) extrinsic: Vec<Named<Extrinsic>>,
    /// Do not interpolate between poses further apart than this, seconds [default: 1, or three times a
    /// trajectory's median interval where that is longer]
    #[arg(long, value_name = "SECONDS", value_parser = crate::parse::interval_ns, help_heading = "Place and time")]
    max_time_gap: Option<i64>,

    /// The lengths by which returns are judged and with which other defaults go: of a `drive` (R_cv at 10, 2, 0.5 and
    /// 0.2 m) or of a `room` (a tenth); `auto` is room for depth cameras
    #[arg(long, value_name = "SCALES", default_value = "auto", value_parser = scales_or_auto)]
    #[arg(help_heading = "Returns and map")]
    scales: Chosen,
    /// Smallest range used, metres [default: 1.5, in a room 0.3]
    #[arg(long, value_name = "METRES", value_parser = crate::parse::length_m, help_heading = "Returns and map")]
    min_range: Option<f64>,
    /// Largest range used, metres [default: 100, in a room 10]
    #[arg(long, value_name = "METRES", value_parser = crate::parse::length_m, help_heading = "Returns and map")]
    max_range: Option<f64>,
    /// The vehicle, whose returns are left out: `auto` (what moves with the sensor), `none`, or a box in the
    /// sensor frame, metres: xmin,ymin,zmin,xmax,ymax,zmax
    #[arg(long, value_name = "EGO", default_value = "auto", value_parser = parse::ego)]
    #[arg(allow_hyphen_values = true, help_heading = "Returns and map")]
    ego: Ego,
}

/// Scales, or none of them: `auto`.
#[derive(Debug, Clone, Copy)]
struct Chosen(Option<Scales>);

fn scales_or_auto(text: &str) -> Result<Chosen, String> {
    parse::scales(text).map(Chosen)
}

/// What may be taken of the machine.
#[derive(Debug, Clone, Args)]
pub(crate) struct ResourceArgs {
    /// Memory to aim for, as 2GiB or 500MB, or `unlimited`; what does not fit goes to --work. What is too little
    /// for the runs is refused with what would do, and too little to be quick is told before the start [default: a quarter of the machine's]
    #[arg(long, value_name = "SIZE", value_parser = parse::memory_bytes, help_heading = "Resources")]
    memory: Option<usize>,
    /// Threads that read, fuse and cast [default: one for each core]
    #[arg(long, value_name = "N", help_heading = "Resources")]
    threads: Option<usize>,
    /// Folder for scratch files and for the maps while they are needed [default: the system's for such files]
    #[arg(long, value_name = "FOLDER", help_heading = "Resources")]
    work: Option<PathBuf>,
}

impl SettingsArgs {
    /// Where and when runs have their poses.
    pub(crate) fn poses(&self) -> (&PlaceArgs, &ClockArgs) {
        (&self.scans.place, &self.clock)
    }

    pub(crate) fn config(&self) -> Config {
        Config {
            segment: self.segment.0,
            free_space: self.free_space,
            miss_price: self.miss_price,
            sigma_m: self.sigma,
            time_offset_ns: self.clock.offset_of_all_ns(),
            ..self.scans.in_config(self.resources.in_config(Config::default()))
        }
    }
}

impl PlaceArgs {
    /// The mapper of a LAS file, of which --extrinsic and the offset of clocks speak too.
    pub(crate) fn mapper(&self, time_offset_ns: i64) -> anyhow::Result<Mapper> {
        Ok(Mapper {
            body_from_sensor: extrinsic::of_mapper(&self.extrinsic)?,
            time_offset_ns,
            max_gap_ns: self.max_time_gap,
        })
    }

    /// The settings with these.
    pub(crate) fn in_config(&self, config: Config) -> Config {
        Config {
            scales: self.scales.0,
            min_range_m: self.min_range,
            max_range_m: self.max_range,
            ego: self.ego,
            max_time_gap_ns: self.max_time_gap,
            ..config
        }
    }
}

impl ScanArgs {
    /// The settings with these.
    pub(crate) fn in_config(&self, config: Config) -> Config {
        Config { voxel_m: self.voxel.0, every: self.every, ..self.place.in_config(config) }
    }
}

impl ResourceArgs {
    pub(crate) fn work(&self) -> Option<&Path> {
        self.work.as_deref()
    }

    /// Memory and threads, as a command takes them.
    pub(crate) fn as_options(&self) -> Vec<String> {
        let memory = self.memory.map(|bytes| format!("--memory={bytes}B"));
        memory.into_iter().chain(self.threads.map(|threads| format!("--threads={threads}"))).collect()
    }

    /// The settings with these.
    pub(crate) fn in_config(&self, config: Config) -> Config {
        let quarter = || dmp::machine_memory_bytes().map(|bytes| (bytes / 4) as usize);
        Config {
            memory_bytes: self.memory.or_else(quarter).unwrap_or(config.memory_bytes),
            threads: self.threads.unwrap_or(config.threads),
            work_folder: self.work.clone().unwrap_or_else(|| config.work_folder.clone()),
            ..config
        }
    }
}

/// Going on where another process stopped.
#[derive(Debug, Args)]
pub(crate) struct ResumeArgs {
    /// Go on from where a killed or failed run of the same command stopped, where it left anything in --work
    #[arg(long, help_heading = "Resources")]
    resume: bool,
    /// Keep what was done in --work after each so many seconds, for --resume, or `none`
    #[arg(long, value_name = "SECONDS", default_value = "30")]
    #[arg(help_heading = "Resources")]
    checkpoint: parse::Every,
}

impl ResumeArgs {
    /// The settings with these.
    pub(crate) fn in_config(&self, config: Config) -> Config {
        Config { checkpoint_every: self.checkpoint.0, resume: self.resume, ..config }
    }
}
