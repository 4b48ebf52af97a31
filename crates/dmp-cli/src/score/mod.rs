//! `dmp score`: score and rank runs.

mod announce;
mod details;
mod pairs;
mod parse;
mod render;
#[cfg(test)]
mod sample;

use std::fs;
use std::io::Write;
use std::path::PathBuf;

use anyhow::Context as _;
use clap::Args;
use dmp::{Config, Ego, Run, evaluate};
use dmp_sensor::Isometry3;

use crate::log_args::LogArgs;
use crate::progress::Progress;
use crate::runs::{self, NamedFile};
use crate::{Common, Exit};

/// Score runs on a log, and rank them
///
/// Fuses each run's map from the scans, casts every return into it and compares measured with predicted
/// ranges. No ground truth is needed. The scores compare runs of one log under one setting, nothing else.
#[derive(Debug, Args)]
#[command(
    override_usage = "dmp score [OPTIONS] LOG -t [NAME=]RUN.tum [-t [NAME=]RUN2.tum ...]",
    after_help = "Examples:\n  \
    dmp score drive.mcap -t runs/*.tum\n  \
    dmp score drive.mcap -t old=a/traj.tum -t new=b/traj.tum --extrinsic 0,0,0.28,0,0,0,1\n  \
    dmp score kitti/07/ -t poses.txt --every 5 --memory 2GiB\n  \
    dmp score drive.mcap -t run.tum --map survey.laz --json > scores.json\n\n\
    Exit codes: 0 done; 1 failed; 2 wrong usage; 3 done, but part of the log was lost or damaged."
)]
pub(crate) struct ScoreArgs {
    /// A run to score: its trajectory in TUM format or KITTI rows, world_from_body in metres. Called NAME, or
    /// like the file
    #[arg(short = 't', long = "trajectory", value_name = "[NAME=]RUN", help_heading = "Input")]
    #[arg(required_unless_present = "more")]
    trajectories: Vec<NamedFile>,
    /// A map to score against instead of the one fused from the scans: LAS, LAZ, PLY or a saved map, in the
    /// world frame of the run NAME, or of all runs
    #[arg(long = "map", value_name = "[NAME=]FILE", help_heading = "Input")]
    maps: Vec<NamedFile>,
    #[command(flatten)]
    log: LogArgs,
    /// More runs: what a shell makes of `-t runs/*.tum`
    #[arg(value_name = "[NAME=]RUN", hide = true)]
    more: Vec<NamedFile>,
    /// Use only every N-th scan, for the map and for the score
    #[arg(long, value_name = "N", default_value_t = 1, help_heading = "Input")]
    every: usize,

    /// Where the sensor sits on the body that the trajectories move, body_from_sensor: metres and a
    /// quaternion, or `identity`
    #[arg(long, value_name = "X,Y,Z,QX,QY,QZ,QW", default_value = "identity", value_parser = parse::extrinsic)]
    #[arg(allow_hyphen_values = true, help_heading = "Place and time")]
    extrinsic: Isometry3<f64>,
    /// Added to every stamp of the log before poses are looked up, seconds
    #[arg(long, value_name = "SECONDS", default_value = "0", value_parser = parse::seconds_ns)]
    #[arg(allow_hyphen_values = true, help_heading = "Place and time")]
    time_offset: i64,
    /// Do not interpolate between poses further apart than this, seconds [default: 1, or three times a
    /// trajectory's median interval where that is longer]
    #[arg(long, value_name = "SECONDS", value_parser = crate::parse::interval_ns, help_heading = "Place and time")]
    max_time_gap: Option<i64>,

    /// Smallest range used, metres
    #[arg(long, value_name = "METRES", default_value_t = Config::default().min_range_m)]
    #[arg(value_parser = crate::parse::length_m, help_heading = "Returns and map")]
    min_range: f64,
    /// Largest range used, metres
    #[arg(long, value_name = "METRES", default_value_t = Config::default().max_range_m)]
    #[arg(value_parser = crate::parse::length_m, help_heading = "Returns and map")]
    max_range: f64,
    /// The vehicle, whose returns are left out: `auto` (what moves with the sensor), `none`, or a box in the
    /// sensor frame, metres: xmin,ymin,zmin,xmax,ymax,zmax
    #[arg(long, value_name = "EGO", default_value = "auto", value_parser = parse::ego)]
    #[arg(allow_hyphen_values = true, help_heading = "Returns and map")]
    ego: Ego,
    /// Edge of a voxel, metres; `auto` takes 0.2, 0.3 or 0.5 m by the density of the scans
    #[arg(long, value_name = "METRES", default_value = "auto", help_heading = "Returns and map")]
    voxel: parse::AutoLength,
    /// Length of a segment of the drive, metres: a return is not compared with what was seen in its own
    /// segment and the two beside it. `auto` is 12 m, or a sixteenth of a shorter drive
    #[arg(long, value_name = "METRES", default_value = "auto", help_heading = "Returns and map")]
    segment: parse::AutoLength,
    /// The sensor's range noise, metres: scales the raw log-likelihood, nothing else
    #[arg(long, value_name = "METRES", default_value_t = Config::default().sigma_m)]
    #[arg(value_parser = crate::parse::length_m, help_heading = "Returns and map")]
    sigma: f64,

    /// Memory to aim for, as 2GiB or 500MB, or `unlimited`; what does not fit goes to --work. Many runs on a
    /// dense log may need more than a small budget: that is told [default: a quarter of the machine's]
    #[arg(long, value_name = "SIZE", value_parser = parse::memory_bytes, help_heading = "Resources")]
    memory: Option<usize>,
    /// Threads that read, fuse and cast [default: one for each core]
    #[arg(long, value_name = "N", help_heading = "Resources")]
    threads: Option<usize>,
    /// Folder for scratch files and for the maps while they are needed [default: the system's for such files]
    #[arg(long, value_name = "FOLDER", help_heading = "Resources")]
    work: Option<PathBuf>,

    /// Print one JSON object (schema dmp-score/1) instead of tables
    #[arg(long, help_heading = "Output")]
    json: bool,
    /// Also print every scale of every pair, all scores, where returns went, times and memory
    #[arg(short, long, conflicts_with = "json", help_heading = "Output")]
    verbose: bool,
    /// Keep the fused maps in this folder, as NAME.dmpmap; it is made if need be
    #[arg(long, value_name = "FOLDER", help_heading = "Output")]
    save_maps: Option<PathBuf>,
}

impl ScoreArgs {
    fn config(&self) -> Config {
        let default = Config::default();
        let quarter = || dmp::machine_memory_bytes().map(|bytes| (bytes / 4) as usize);
        Config {
            voxel_m: self.voxel.0,
            segment_m: self.segment.0,
            min_range_m: self.min_range,
            max_range_m: self.max_range,
            ego: self.ego,
            every: self.every,
            body_from_sensor: self.extrinsic,
            time_offset_ns: self.time_offset,
            max_time_gap_ns: self.max_time_gap,
            sigma_m: self.sigma,
            memory_bytes: self.memory.or_else(quarter).unwrap_or(default.memory_bytes),
            threads: self.threads.unwrap_or(default.threads),
            work_folder: self.work.clone().unwrap_or(default.work_folder),
            save_maps: self.save_maps.clone(),
            order: default.order,
        }
    }
}

pub(crate) fn run(arguments: &ScoreArgs, common: &Common, out: &mut impl Write) -> anyhow::Result<Exit> {
    let config = arguments.config();
    config.check()?;
    // What is short comes first, so that a mistake in it is told before a long log is read.
    let files: Vec<NamedFile> = arguments.trajectories.iter().chain(&arguments.more).cloned().collect();
    let loaded = runs::load(&files)?;
    let maps = runs::maps_of(&loaded, &arguments.maps)?;
    if let Some(folder) = &arguments.save_maps {
        fs::create_dir_all(folder)
            .with_context(|| format!("{}: cannot make the folder", folder.display()))?;
    }
    let log = arguments.log.open()?;
    if !common.quiet {
        announce::found(log.as_ref(), &loaded);
    }
    let runs: Vec<Run> = loaded
        .into_iter()
        .zip(maps)
        .map(|(run, map)| Run { name: run.name, trajectory: run.file.trajectory, map })
        .collect();

    let progress = Progress::new(common);
    let report = evaluate(log.as_ref(), &runs, &config, &progress)?;
    drop(progress);
    if arguments.json {
        serde_json::to_writer_pretty(&mut *out, &report).map_err(std::io::Error::from)?;
        writeln!(out)?;
    } else {
        render::report(out, &report, arguments.verbose)?;
    }
    if !common.quiet {
        announce::done(&report);
    }
    Ok(if report.inputs.damage.is_empty() { Exit::Done } else { Exit::InputDamaged })
}
