//! `dmp convert trajectory`: a trajectory in another format.

use std::io::Write;
use std::path::PathBuf;

use clap::{Args, ValueEnum};
use dmp_draw::text::counted;
use dmp_log::{
    TimeUnit, TrajectoryFormat, read_trajectory_as, write_euroc, write_kitti, write_redwood_log, write_times,
    write_tum,
};

use crate::clash::is_same_place;
use crate::common::Common;
use crate::exit::{Exit, Usage};
use crate::save::{SavedTogether, may_be_file};
use crate::say::say;

/// The formats of trajectories that are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum To {
    /// Lines of stamp, place, quaternion x y z w
    Tum,
    /// Lines of 3 × 4 matrices; stamps go into times.txt beside it
    Kitti,
    /// Lines of stamp in nanoseconds, place, quaternion w x y z
    Euroc,
    /// Blocks of a 4 × 4 matrix each (Redwood's .log); stamps go into times.txt beside it
    Redwood,
}

/// Write a trajectory in another format
///
/// Poses come out in order of time, repeated ones once.
#[derive(Debug, Args)]
#[command(
    override_usage = "dmp convert trajectory [OPTIONS] RUN -o OUTPUT --to FORMAT",
    after_help = "Example:\n  dmp convert trajectory kiss_poses.npy -o kiss.txt --to kitti"
)]
pub(crate) struct TrajectoryConvertArgs {
    /// The trajectory: TUM, KITTI rows, EuRoC, .npy, g2o, Redwood or csv with names of columns
    #[arg(value_name = "RUN")]
    run: PathBuf,
    /// Its format, where it is not to be found by looking
    #[arg(long, value_name = "FORMAT", help_heading = "Input")]
    trajectory_format: Option<TrajectoryFormat>,
    /// The unit of its stamps, where it is not that of its format (s in TUM, ns in EuRoC) or is asked for: s, ms, us or ns
    #[arg(long, value_name = "UNIT", help_heading = "Input")]
    time_unit: Option<TimeUnit>,
    /// The file to write
    #[arg(short, long, value_name = "OUTPUT", help_heading = "Output")]
    output: PathBuf,
    /// The format to write
    #[arg(long, value_name = "FORMAT", help_heading = "Output")]
    to: To,
}

pub(super) fn run(
    arguments: &TrajectoryConvertArgs,
    common: &Common,
    out: &mut impl Write,
) -> anyhow::Result<Exit> {
    let TrajectoryConvertArgs { run, output, to, .. } = arguments;
    let file = read_trajectory_as(run, arguments.trajectory_format, arguments.time_unit)?;
    if !common.quiet {
        let counts = [
            ("were sorted by their stamps", file.out_of_order),
            ("are there twice, written once", file.repeated),
        ];
        for (what, count) in counts.into_iter().filter(|(_, count)| *count > 0) {
            say!(common.host, "note: {}: {} {what}", run.display(), counted(count as u64, "pose"));
        }
        file.notes.iter().for_each(|note| say!(common.host, "note: {}: {note}", run.display()));
    }
    let trajectory = file.trajectory;
    let without_stamps = matches!(to, To::Kitti | To::Redwood);
    if trajectory.stamps_ns().is_none() && !without_stamps {
        let problem = "its poses have no stamps: they can be written as KITTI rows or Redwood's blocks alone";
        return Err(Usage(format!("{}: {problem}", run.display())).into());
    }
    let times = output.with_file_name("times.txt");
    // Beside a pipe or a device nothing is made.
    let stamps_ns = trajectory.stamps_ns().filter(|_| without_stamps && may_be_file(output));
    if stamps_ns.is_some() && is_same_place(&times, output) {
        let problem = "the output and its stamps would have this name";
        return Err(Usage(format!("{}: {problem}", times.display())).into());
    }
    let mut files = SavedTogether::default();
    files.add(output, |out| match to {
        To::Tum => write_tum(out, &trajectory),
        To::Kitti => write_kitti(out, &trajectory),
        To::Euroc => write_euroc(out, &trajectory),
        To::Redwood => write_redwood_log(out, &trajectory),
    })?;
    if let Some(stamps_ns) = stamps_ns {
        files.add_unnamed(&times, |out| write_times(out, stamps_ns))?;
    }
    files.commit()?;
    writeln!(out, "{}: {}", output.display(), counted(trajectory.len() as u64, "pose"))?;
    if stamps_ns.is_some() {
        writeln!(out, "{}: their stamps", times.display())?;
    }
    Ok(Exit::Done)
}
