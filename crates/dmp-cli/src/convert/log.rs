//! `dmp convert log`: the scans of a log in another format.

use std::io::Write;
use std::path::PathBuf;

use anyhow::{Context as _, bail};
use clap::Args;
use dmp::Config;
use dmp_draw::text::counted;
use dmp_sensor::{Isometry3, Scan};

use crate::common::Common;
use crate::exit::{Exit, Usage};
use crate::log_args::{LogArgs, Mapper};
use crate::log_writer::{CompressionArg, LogWriter, OutputFormat};
use crate::progress::Progress;
use crate::say::say;
use crate::score::parse;

/// Write the scans of a log in another format
///
/// Places and times of returns are kept, other fields are not. A stamp that lies behind the first return of its
/// scan is moved to it; the instants stay what they are.
#[derive(Debug, Args)]
#[command(
    override_usage = "dmp convert log [OPTIONS] LOG -o OUTPUT",
    after_help = "Examples:\n  \
    dmp convert log drive.mcap -o drive-fast.mcap --compression none\n  \
    dmp convert log bag/ --topic /lidar/points -o scans --to pcd\n  \
    dmp convert log kitti/07/ -o kitti07.mcap"
)]
pub(crate) struct LogConvertArgs {
    #[command(flatten)]
    log: LogArgs,
    /// With --made-with: where the sensor sat on the body, body_from_sensor, metres and a quaternion
    #[arg(long, value_name = "X,Y,Z,QX,QY,QZ,QW", default_value = "0,0,0,0,0,0,1", value_parser = parse::transform)]
    #[arg(requires = "made_with", allow_hyphen_values = true, help_heading = "Place and time")]
    extrinsic: Isometry3<f64>,
    /// With --made-with: added to the times of points before poses are looked up, seconds
    #[arg(long, value_name = "SECONDS", default_value = "0", value_parser = parse::seconds_ns)]
    #[arg(requires = "made_with", allow_hyphen_values = true, help_heading = "Place and time")]
    time_offset: i64,
    /// What to write: FILE.mcap or a folder, which must not be there yet
    #[arg(short, long, value_name = "OUTPUT", help_heading = "Output")]
    output: PathBuf,
    /// The format; without it MCAP where OUTPUT ends in .mcap, else a folder of .bin
    #[arg(long, value_name = "FORMAT", help_heading = "Output")]
    to: Option<OutputFormat>,
    /// How an MCAP file is packed [default: zstd]
    #[arg(long, value_name = "KIND", help_heading = "Output")]
    compression: Option<CompressionArg>,
}

pub(super) fn run(arguments: &LogConvertArgs, common: &Common, out: &mut impl Write) -> anyhow::Result<Exit> {
    let format = match arguments.to {
        Some(format) => format,
        None => OutputFormat::of_name(&arguments.output)?,
    };
    check_output(arguments, format)?;
    let mapper = Mapper {
        body_from_sensor: Some(arguments.extrinsic),
        time_offset_ns: arguments.time_offset,
        max_gap_ns: None,
    };
    let log = arguments.log.open(&mapper, Config::default().threads)?;
    let compression = arguments.compression.unwrap_or(CompressionArg::Zstd);
    let mut writer = LogWriter::create(&arguments.output, format, compression)?;
    let progress = Progress::new(common);
    progress.reading("converting", "points");
    let mut reader = log.reader()?;
    let (mut scan, mut returns) = (Scan::default(), 0);
    for frame in 0..log.frames().len() {
        reader.read(frame, &mut scan)?;
        count_from_first(&mut scan);
        writer.write(&scan)?;
        returns += scan.len() as u64;
        progress.done(scan.len() as u64);
        common.host.go_on()?;
    }
    writer.finish()?;
    drop(progress);
    let scans = counted(log.frames().len() as u64, "scan");
    writeln!(out, "{}: {scans}, {}", arguments.output.display(), counted(returns, "return"))?;
    if let Some(precision) = format.precision() {
        writeln!(out, "{precision}")?;
    }
    if log.summary().camera.is_some() {
        writeln!(out, "points of depth images: score them with --scales room; the camera is not kept")?;
    }
    let damage = &log.summary().damage;
    if !common.quiet {
        damage.iter().for_each(|lost| say!(common.host, "lost: {}: {}", lost.place, lost.what));
    }
    Ok(if damage.is_empty() { Exit::Done } else { Exit::InputDamaged })
}

/// What would be a surprise is refused: a log that is there already, an option without effect, a folder that
/// is called like a file.
fn check_output(arguments: &LogConvertArgs, format: OutputFormat) -> anyhow::Result<()> {
    let path = arguments.output.display();
    if arguments.output.try_exists().with_context(|| path.to_string())? {
        bail!(Usage(format!("{path}: there is something already, it is not overwritten")));
    }
    let is_mcap = format == OutputFormat::Mcap;
    if arguments.compression.is_some() && !is_mcap {
        bail!(Usage(format!("{path}: --compression is for MCAP files alone")));
    }
    if arguments.output.extension().is_some_and(|extension| extension == "mcap") != is_mcap {
        bail!(Usage(format!("{path}: an MCAP file is FILE.mcap, a folder has another name")));
    }
    Ok(())
}

/// Formats that know no time before the stamp get a stamp before all times; the instants are the same. What
/// did not come back has no instant: its time, often a zero on the clock of the stamps, becomes the stamp's.
fn count_from_first(scan: &mut Scan) {
    let came_back = |point: &[f32; 3]| point.iter().all(|c| c.is_finite()) && *point != [0.0; 3];
    let points = &scan.points_in_sensor_m;
    let of_returns = scan.time_offsets_ns.iter().zip(points).filter(|(_, point)| came_back(point));
    let first_ns = of_returns.map(|(&offset_ns, _)| offset_ns).min().unwrap_or(0).min(0);
    let Some(stamp_ns) = scan.stamp_ns.map_or(Some(0), |stamp_ns| stamp_ns.checked_add(first_ns)) else {
        return;
    };
    scan.stamp_ns = scan.stamp_ns.map(|_| stamp_ns);
    for (offset_ns, point) in scan.time_offsets_ns.iter_mut().zip(points) {
        *offset_ns = if came_back(point) { *offset_ns - first_ns } else { 0 };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_before_the_stamp_move_it_and_stay_where_they_are() {
        let before = Scan {
            stamp_ns: Some(1_000),
            points_in_sensor_m: vec![[1.0; 3]; 3],
            time_offsets_ns: vec![-300, 20, -7],
        };
        let mut after = before.clone();
        count_from_first(&mut after);
        assert_eq!((after.stamp_ns, after.time_offsets_ns.as_slice()), (Some(700), [0, 320, 293].as_slice()));
        let mut again = after.clone();
        count_from_first(&mut again);
        assert_eq!(again, after);
        // A row without a place, and a zero on an absolute clock for its time.
        let hole = Scan {
            stamp_ns: Some(1_700_000_000_000_000_000),
            points_in_sensor_m: vec![[0.0; 3], [1.0; 3], [f32::NAN; 3]],
            time_offsets_ns: vec![-1_700_000_000_000_000_000, 5, 7],
        };
        let mut filled = hole.clone();
        count_from_first(&mut filled);
        assert_eq!(
            (filled.stamp_ns, filled.time_offsets_ns.as_slice()),
            (hole.stamp_ns, [0, 5, 0].as_slice())
        );
    }
}
