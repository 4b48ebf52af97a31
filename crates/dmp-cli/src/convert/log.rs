use std::io::Write;
use std::path::PathBuf;

use anyhow::bail;
use clap::Args;
use dmp_sensor::{Isometry3, Scan};

use crate::log_args::{LogArgs, Mapper};
use crate::log_writer::{CompressionArg, LogWriter, OutputFormat};
use crate::progress::Progress;
use crate::score::parse;
use crate::text::counted;
use crate::{Common, Exit, process};

/// Write the scans of a log in another format
///
/// Places and times of returns are kept, other fields are not. The times are written after the first return of
/// their scan, whatever they counted from before.
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
    /// What to write: FILE.mcap, or a folder that is not there yet
    #[arg(short, long, value_name = "OUTPUT", help_heading = "Output")]
    output: PathBuf,
    /// The format; without it MCAP where OUTPUT ends in .mcap, else a folder of .bin
    #[arg(long, value_name = "FORMAT", help_heading = "Output")]
    to: Option<OutputFormat>,
    /// How an MCAP file is packed
    #[arg(long, value_name = "KIND", default_value = "zstd", help_heading = "Output")]
    compression: CompressionArg,
}

pub(super) fn run(arguments: &LogConvertArgs, common: &Common, out: &mut impl Write) -> anyhow::Result<Exit> {
    let format = match arguments.to {
        Some(format) => format,
        None => OutputFormat::of_name(&arguments.output)?,
    };
    let mapper = Mapper {
        body_from_sensor: arguments.extrinsic,
        time_offset_ns: arguments.time_offset,
        ..Mapper::default()
    };
    let log = arguments.log.open(&mapper)?;
    crate::save::refuse_same(&log.summary().path, &arguments.output)?;
    let mut writer = LogWriter::create(&arguments.output, format, arguments.compression)?;
    let progress = Progress::new(common);
    progress.reading("converting", "points/s");
    let mut reader = log.reader()?;
    let (mut scan, mut returns) = (Scan::default(), 0);
    for frame in 0..log.frames().len() {
        reader.read(frame, &mut scan)?;
        count_from_first(&mut scan);
        writer.write(&scan)?;
        returns += scan.len() as u64;
        if progress.read(scan.len()).is_err() || process::interrupted() {
            bail!(dmp::EvaluateError::Cancelled);
        }
    }
    writer.finish()?;
    drop(progress);
    let scans = counted(log.frames().len() as u64, "scan");
    writeln!(out, "{}: {scans}, {}", arguments.output.display(), counted(returns, "return"))?;
    if let Some(precision) = format.precision() {
        writeln!(out, "{precision}")?;
    }
    let damage = &log.summary().damage;
    if !common.quiet {
        damage.iter().for_each(|lost| eprintln!("lost: {}: {}", lost.place, lost.what));
    }
    Ok(if damage.is_empty() { Exit::Done } else { Exit::InputDamaged })
}

/// Formats that know no time before the stamp get a stamp before all times; the instants are the same.
fn count_from_first(scan: &mut Scan) {
    let first_ns = scan.time_offsets_ns.iter().copied().min().unwrap_or(0);
    if let Some(stamp_ns) =
        scan.stamp_ns.filter(|_| first_ns < 0).and_then(|stamp| stamp.checked_add(first_ns))
    {
        scan.stamp_ns = Some(stamp_ns);
        scan.time_offsets_ns.iter_mut().for_each(|offset| *offset -= first_ns);
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
    }
}
