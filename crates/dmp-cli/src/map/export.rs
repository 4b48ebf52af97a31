//! `dmp map export`: a map's surfels as a point cloud.

use std::io::Write;
use std::path::{Path, PathBuf};

use clap::Args;
use dmp_draw::text;
use dmp_log::{CloudFormat, CloudWriter, OrientedPoint};
use dmp_map::{Store, TileEntry, TileId};

use crate::common::Common;
use crate::exit::{Exit, Usage};
use crate::progress::Progress;

/// Write a map's surfels as a point cloud with normals: LAZ, LAS, PLY or PCD
///
/// Places are those of the frame of the run's trajectory, in metres. Memory does not grow with the map.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    dmp map export maps/truth.dmpmap -o truth.laz\n  \
    dmp map export maps/truth.dmpmap -o corner.ply --box -20,-20,40,40")]
pub(crate) struct ExportArgs {
    /// The map
    #[arg(value_name = "MAP")]
    map: PathBuf,
    /// The cloud: FILE.laz, .las, .ply or .pcd
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Only surfels whose centres lie in this box, metres in the frame of the run's trajectory
    #[arg(long = "box", value_name = "XMIN,YMIN,XMAX,YMAX", allow_hyphen_values = true, value_parser = square)]
    within: Option<[f64; 4]>,
}

fn square(text: &str) -> Result<[f64; 4], String> {
    let numbers: Vec<f64> = text.split(',').filter_map(|part| part.trim().parse().ok()).collect();
    match numbers[..] {
        [x0, y0, x1, y1] if x0 < x1 && y0 < y1 && text.split(',').count() == 4 => Ok([x0, y0, x1, y1]),
        _ => Err(format!("`{text}` is no box: try -20,-20,40,40 for XMIN,YMIN,XMAX,YMAX")),
    }
}

fn format_of(path: &Path) -> Result<CloudFormat, Usage> {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    match extension.as_str() {
        "laz" => Ok(CloudFormat::Laz),
        "las" => Ok(CloudFormat::Las),
        "ply" => Ok(CloudFormat::Ply),
        "pcd" => Ok(CloudFormat::Pcd),
        _ => Err(Usage(format!("{}: a cloud is written as .laz, .las, .ply or .pcd", path.display()))),
    }
}

pub(super) fn run(arguments: &ExportArgs, common: &Common, out: &mut impl Write) -> anyhow::Result<Exit> {
    let format = format_of(&arguments.output)?;
    let map = Store::open(&arguments.map)?;
    let in_reach = |entry: &&TileEntry| {
        arguments.within.is_none_or(|[x0, y0, x1, y1]| {
            let [low, high] = map.box_in_own_m(entry);
            low[0] <= x1 && high[0] >= x0 && low[1] <= y1 && high[1] >= y0
        })
    };
    let mut tiles: Vec<TileId> = map.entries().filter(in_reach).map(|entry| entry.tile).collect();
    tiles.sort_unstable();
    let progress = Progress::new(common);

    // Headers tell how many points there are: of a box that is known once it was looked at.
    let (mut points, mut near_m) = (0, None);
    progress.tiles("counting", tiles.len() as u64);
    for &id in &tiles {
        common.host.go_on()?;
        if arguments.within.is_none() && near_m.is_some() {
            points += map.entry(id).map_or(0, |entry| u64::from(entry.own.surfels));
        } else {
            for point in points_of(&map, id, arguments.within)? {
                near_m.get_or_insert(point.point_m);
                points += 1;
            }
        }
        progress.one_tile();
    }
    progress.tiles("writing", tiles.len() as u64);
    let mut writer = CloudWriter::create(&arguments.output, format, points, near_m.unwrap_or_default())?;
    for &id in &tiles {
        common.host.go_on()?;
        for point in points_of(&map, id, arguments.within)? {
            writer.write(&point)?;
        }
        progress.one_tile();
    }
    drop(progress);
    writer.finish()?;
    writeln!(out, "{}: {}", arguments.output.display(), text::counted(points, "surfel"))?;
    Ok(Exit::Done)
}

/// A tile's own surfels in the frame of the run's trajectory, those outside the box left out.
fn points_of(map: &Store, id: TileId, within: Option<[f64; 4]>) -> anyhow::Result<Vec<OrientedPoint>> {
    let in_own = map
        .discs_in_own(id)?
        .map(|disc| OrientedPoint { point_m: disc.centre_in_own_m, normal: disc.normal_in_own });
    let inside = |point: &OrientedPoint| {
        let [x, y, _] = point.point_m;
        within.is_none_or(|[x0, y0, x1, y1]| (x0..=x1).contains(&x) && (y0..=y1).contains(&y))
    };
    Ok(in_own.filter(inside).collect())
}
