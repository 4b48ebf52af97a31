//! `dmp simulate errors`: a trajectory made worse by a known amount.

use dmp_draw::text::counted;
use std::io::Write;
use std::path::PathBuf;

use clap::{ArgGroup, Args};
use dmp_log::read_trajectory;
use dmp_sim::{Noise, SlamErrors, ate_rmse_m};

use super::fault::told;
use crate::common::Common;
use crate::exit::Exit;
use crate::parse;
use crate::save::save_trajectory;
use crate::say::say;

/// Make a wrong trajectory from a good one
///
/// The errors are those that SLAM systems make, of known size. Several combine in the order of this help,
/// each applied to the result of the one before. The same seed gives the same errors.
#[derive(Debug, Args)]
#[command(group = ArgGroup::new("error").required(true).multiple(true)
    .args(["scale", "bend", "drift_ate", "false_loop", "collapse", "noise"]))]
#[command(after_help = "Examples:\n  \
    dmp simulate errors truth.tum --drift-ate 1 -o drift.tum\n  \
    dmp simulate errors truth.tum --noise 0.03,0.1deg -o noise.tum\n  \
    dmp simulate errors truth.tum --false-loop 20 --noise 2cm -o both.tum")]
pub(crate) struct ErrorsArgs {
    /// The good trajectory: TUM, or KITTI rows
    #[arg(value_name = "TRAJ")]
    trajectory: PathBuf,
    /// The wrong trajectory: TUM, or KITTI rows where the good one has no stamps
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// All distances grow by this factor
    #[arg(long, value_name = "FACTOR")]
    scale: Option<f64>,
    /// The run bends upwards by this height in metres, highest in the middle, and tilts with it
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true, value_parser = parse::length_m)]
    bend: Option<f64>,
    /// Smooth drift of heading, tilt and step length with this ATE in metres (RMSE after rigid alignment)
    #[arg(long, value_name = "LENGTH", value_parser = parse::length_m)]
    drift_ate: Option<f64>,
    /// A wrong loop closure that maps two places this many metres apart onto each other
    #[arg(long, value_name = "LENGTH", value_parser = parse::length_m)]
    false_loop: Option<f64>,
    /// Share of the travel, in the middle of the run, during which the estimate stands still
    #[arg(long, value_name = "SHARE")]
    collapse: Option<f64>,
    /// White noise of every scan's pose: standard deviation along and about each axis, e.g. 0.03,0.1deg
    #[arg(long, value_name = "LENGTH,ANGLE", value_parser = parse::noise)]
    noise: Option<(f64, f64)>,
    /// Time between scans: where poses are denser, they share the noise of a scan, so that the motion within
    /// the scan stays true
    #[arg(long, default_value = "100ms", value_name = "TIME", value_parser = parse::interval_ns)]
    noise_interval: i64,
    /// Another number makes other drift, another loop, other noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

pub(super) fn run(arguments: &ErrorsArgs, common: &Common, out: &mut impl Write) -> anyhow::Result<Exit> {
    let file = read_trajectory(&arguments.trajectory)?;
    if !common.quiet {
        for note in &file.notes {
            say!(common.host, "note: {}: {note}", arguments.trajectory.display());
        }
    }
    let interval_ns = arguments.noise_interval;
    let noise = arguments.noise.map(|(sigma_m, sigma_rad)| Noise { sigma_m, sigma_rad, interval_ns });
    let errors = SlamErrors {
        seed: arguments.seed,
        scale: arguments.scale,
        bend_m: arguments.bend,
        drift_ate_m: arguments.drift_ate,
        false_loop_m: arguments.false_loop,
        collapse_share: arguments.collapse,
        noise,
    };
    let wrong = errors.apply(&file.trajectory).map_err(told)?;
    save_trajectory(&arguments.output, &wrong)?;
    let ate_m = ate_rmse_m(&wrong, &file.trajectory);
    writeln!(
        out,
        "{}: {}, ATE {ate_m:.3} m",
        arguments.output.display(),
        counted(wrong.len() as u64, "pose")
    )?;
    Ok(Exit::Done)
}
