//! `dmp convert log`: the scans of a log in another format.

use std::io::Write as _;
use std::path::Path;

use anyhow::{Context as _, bail};
use dmp::Config;
use dmp_draw::text::counted;
use dmp_log::{LogError, MadeWith, read_trajectory};
use dmp_sensor::Scan;

use crate::console::{Common, Exit, Progress, Usage, say};
use crate::files::{Compression, LogWriter, OutputFormat};
use crate::inputs::LogInput;
use crate::options::{Asked, Out, Spec, input, tools};

/// Length of the scans that a file in world coordinates is cut into, where it is not given: nanoseconds.
const SCAN_PERIOD_NS: i64 = 100_000_000;

pub(super) static SPEC: Spec = Spec {
    name: "log",
    about: "Write the scans of a log in another format",
    more: "Keeps positions and times of returns, drops other fields. A stamp later than the first return of its scan is moved to \
           that return; the times of all returns stay the same.",
    usage: "dmp convert log [OPTIONS] LOG -o OUTPUT",
    after: "Examples:\n  \
            dmp convert log drive.mcap -o drive-fast.mcap --compression none\n  \
            dmp convert log bag/ --topic /lidar/points -o scans --to pcd\n  \
            dmp convert log mapped.laz --made-with slam.tum -o drive.mcap\n  \
            dmp convert log kitti/07/ -o kitti07.mcap",
    options: &[
        &[&input::LOG],
        input::READING,
        &[&input::MADE_WITH, &input::SCAN_PERIOD, &tools::MAPPED_FROM, &tools::MAPPED_AT],
        &[&tools::LOG_OUTPUT, &tools::LOG_FORMAT, &tools::COMPRESSION],
    ],
    run,
    ..Spec::EMPTY
};

/// What brings points in world coordinates back into the sensor's frame.
fn made_with(path: &Path, asked: &Asked) -> Result<MadeWith, LogError> {
    Ok(MadeWith {
        trajectory: read_trajectory(path)?.trajectory,
        body_from_sensor: asked.get(&tools::MAPPED_FROM).unwrap_or_default(),
        time_offset_ns: asked.get(&tools::MAPPED_AT).unwrap_or_default(),
        max_gap_ns: None,
        scan_period_ns: asked.get(&input::SCAN_PERIOD).unwrap_or(SCAN_PERIOD_NS),
    })
}

fn run(asked: &Asked, common: &Common, out: &mut Out<'_>) -> anyhow::Result<Exit> {
    let (output, compression) = (asked.need(&tools::LOG_OUTPUT)?, asked.get(&tools::COMPRESSION));
    let format = match asked.get(&tools::LOG_FORMAT) {
        Some(format) => format,
        None => OutputFormat::of_name(&output)?,
    };
    check_output(&output, compression.is_some(), format)?;
    let mut input = LogInput::of(asked)?;
    input.options.made_with = asked.get(&input::MADE_WITH).map(|path| made_with(&path, asked)).transpose()?;
    let log = input.open(Config::default().threads)?;
    let mut writer = LogWriter::create(&output, format, compression.unwrap_or(Compression::Zstd))?;
    let progress = Progress::new(common);
    progress.start("converting", "points", 0);
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
    writeln!(out, "{}: {scans}, {}", output.display(), counted(returns, "return"))?;
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

/// Refuses a log that exists, an option without effect, and a folder named like a file.
fn check_output(output: &Path, has_compression: bool, format: OutputFormat) -> anyhow::Result<()> {
    let path = output.display();
    if output.try_exists().with_context(|| path.to_string())? {
        bail!(Usage(format!("{path}: it exists, and is not overwritten")));
    }
    let is_mcap = format == OutputFormat::Mcap;
    if has_compression && !is_mcap {
        bail!(Usage(format!("{path}: --compression is for MCAP files only")));
    }
    if output.extension().is_some_and(|extension| extension == "mcap") != is_mcap {
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
