//! `dmp map export`: a map's surfels as a point cloud.

use std::io::Write as _;
use std::path::Path;

use dmp_draw::text;
use dmp_log::{CloudFormat, CloudWriter, OrientedPoint};
use dmp_map::{Store, TileEntry, TileId};

use crate::console::{Common, Exit, Progress, Usage};
use crate::options::{Asked, Out, Spec, tools};

pub(super) static SPEC: Spec = Spec {
    name: "export",
    about: "Write a map's surfels as a point cloud with normals: LAZ, LAS, PLY or PCD",
    more: "Coordinates are those of the run's trajectory, in metres. Memory does not grow with the map.",
    after: "Examples:\n  \
            dmp map export maps/truth.dmpmap -o truth.laz --crs EPSG:32632\n  \
            dmp map export maps/truth.dmpmap -o corner.ply --box -20,-20,40,40",
    options: &[&[&tools::MAP, &tools::EXPORTED, &tools::BOX, &tools::CRS]],
    run,
    ..Spec::EMPTY
};

fn format_of(path: &Path) -> Result<CloudFormat, Usage> {
    if path.to_string_lossy().to_ascii_lowercase().ends_with(".copc.laz") {
        let problem = "COPC is read, not written: write a .laz, and make COPC of it with `pdal translate`";
        return Err(Usage(format!("{}: {problem}", path.display())));
    }
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    match extension.as_str() {
        "laz" => Ok(CloudFormat::Laz),
        "las" => Ok(CloudFormat::Las),
        "ply" => Ok(CloudFormat::Ply),
        "pcd" => Ok(CloudFormat::Pcd),
        _ => Err(Usage(format!("{}: a cloud is written as .laz, .las, .ply or .pcd", path.display()))),
    }
}

fn run(asked: &Asked, common: &Common, out: &mut Out<'_>) -> anyhow::Result<Exit> {
    let (output, within) = (asked.need(&tools::EXPORTED)?, asked.get(&tools::BOX));
    let (format, crs) = (format_of(&output)?, asked.get(&tools::CRS));
    if crs.is_some() && !matches!(format, CloudFormat::Las | CloudFormat::Laz) {
        let problem = "a .ply or .pcd names no coordinate system: leave --crs out, or write a .laz";
        return Err(Usage(format!("{}: {problem}", output.display())).into());
    }
    let map = Store::open(&asked.need(&tools::MAP)?)?;
    let in_reach = |entry: &&TileEntry| {
        within.is_none_or(|[x0, y0, x1, y1]| {
            let [low, high] = map.box_in_own_m(entry);
            low[0] <= x1 && high[0] >= x0 && low[1] <= y1 && high[1] >= y0
        })
    };
    let mut tiles: Vec<TileId> = map.entries().filter(in_reach).map(|entry| entry.tile).collect();
    tiles.sort_unstable();
    let progress = Progress::new(common);

    // Headers have the number of points: of a box they are counted first.
    let (mut points, mut near_m) = (0, None);
    progress.start("counting", "tiles", tiles.len() as u64);
    for &id in &tiles {
        common.host.go_on()?;
        if within.is_none() && near_m.is_some() {
            points += map.entry(id).map_or(0, |entry| u64::from(entry.own.surfels));
        } else {
            for point in points_of(&map, id, within)? {
                near_m.get_or_insert(point.point_m);
                points += 1;
            }
        }
        progress.done(1);
    }
    progress.start("writing", "tiles", tiles.len() as u64);
    let mut writer = CloudWriter::create(&output, format, points, near_m.unwrap_or_default(), crs.as_ref())?;
    for &id in &tiles {
        common.host.go_on()?;
        for point in points_of(&map, id, within)? {
            writer.write(&point)?;
        }
        progress.done(1);
    }
    drop(progress);
    writer.finish()?;
    writeln!(out, "{}: {}", output.display(), text::counted(points, "surfel"))?;
    Ok(Exit::Done)
}

/// A tile's own surfels in the frame of the run's trajectory, without those outside the box.
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
