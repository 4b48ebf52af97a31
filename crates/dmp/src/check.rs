//! Looks at one map alone: how thick it is, where surfaces stand twice, what is missing.

use std::path::Path;

use dmp_disk::WorkFolder;
use dmp_log::{read_cloud, shown_path};
use dmp_map::{Durability, Lattice, MapError, MapFuser, Origin, Store, Thickness};
use dmp_reduce::Scales;
use dmp_report::{GroundPlan, MapCheck, PlanColumn};
use dmp_runs::{Config, EvaluateError, Stage, Watch, pool, so_far};
use dmp_sensor::Isometry3;

use crate::passes::fuse_given;

/// Most columns of a plan: of a larger map they are wider.
const MOST_COLUMNS: f64 = 3e7;

/// Looks at a cloud: LAS, LAZ, PLY, PCD or E57. It is read twice; memory is that of [`Config::memory_bytes`].
///
/// # Errors
/// When the file cannot be read, or the folder for work not be written.
pub fn check_cloud<'a>(
    cloud: &Path,
    config: &Config,
    watch: impl Into<Watch<'a>>,
) -> Result<MapCheck, EvaluateError> {
    let progress = watch.into().progress;
    let (settings, means) = config.on_scales(Scales::Drive)?;
    let work = WorkFolder::new(&means.work_folder)?;
    let lattice = Lattice::new(settings.voxel_m.unwrap_or(settings.scales.lengths().cloud_voxel_m))?;
    let name = shown_path(cloud);
    pool(means.threads)?.install(|| {
        let fuser = MapFuser::new(lattice, means.cloud_map_bytes(), work.path())?;
        let found = fuse_given(cloud, &name, settings.map_unit, (&fuser, &Isometry3::identity()), progress)?;
        let points = fuser.points();
        let path = work.path().join("checked.dmpmap");
        let (origin, on_tile) = (Origin::of(name.as_str()), so_far(progress, Stage::Surfels));
        let cells = fuser.finish(&path, &origin, Durability::Temporary, &on_tile)?.cells;
        let mut search = cells.search_layers(&lattice);
        progress.begin(Stage::ReadMap, points);
        read_cloud(cloud, settings.map_unit, |batch| {
            progress.advance(batch.len() as u64);
            let finite: Vec<[f64; 3]> =
                batch.iter().filter(|point| point.iter().all(|c| c.is_finite())).copied().collect();
            if progress.cancelled() { Err(EvaluateError::Cancelled) } else { Ok(search.add(&finite)?) }
        })?;
        let map = Store::open_once(&path)?;
        let mut plan = plan(&map)?;
        Ok(MapCheck {
            schema: MapCheck::SCHEMA,
            path: name.clone(),
            points: Some(points),
            points_dropped: found.dropped,
            surfels: map.surfels(),
            voxel_m: lattice.voxel_m(),
            thickness: cells
                .thickness(&lattice, 0)
                .map(|found| Thickness { layers: search.found(), ..found }),
            holes: plan.holes(),
            notes: found.notes,
            plan,
            flat: cells.flat_places(&lattice),
        })
    })
}

/// Looks at a store: where it has surfaces. It holds one disc for each voxel, which has no thickness.
///
/// # Errors
/// When the file cannot be read, or is damaged.
pub fn check_store(path: &Path) -> Result<MapCheck, MapError> {
    let map = Store::open(path)?;
    let mut plan = plan(&map)?;
    Ok(MapCheck {
        schema: MapCheck::SCHEMA,
        path: shown_path(path),
        points: None,
        points_dropped: 0,
        surfels: map.surfels(),
        voxel_m: map.lattice().voxel_m(),
        thickness: None,
        holes: plan.holes(),
        notes: vec![map.origin().text.clone()],
        plan,
        flat: Vec::new(),
    })
}

/// The columns that hold surfels.
fn plan(map: &Store) -> Result<GroundPlan, MapError> {
    let [mut low_m, mut high_m] = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
    for entry in map.entries() {
        for disc in map.discs_in_own(entry.tile)? {
            for (k, at_m) in disc.centre_in_own_m.into_iter().take(2).enumerate() {
                (low_m[k], high_m[k]) = (low_m[k].min(at_m), high_m[k].max(at_m));
            }
        }
    }
    if low_m[0] > high_m[0] {
        return Ok(GroundPlan::default());
    }
    let size_m = [high_m[0] - low_m[0], high_m[1] - low_m[1]];
    let column_m = (2.0 * map.lattice().voxel_m()).max((size_m[0] * size_m[1] / MOST_COLUMNS).sqrt());
    let [width, height] = size_m.map(|m| (m / column_m) as usize + 1);
    let mut columns = vec![PlanColumn::Outside; width * height];
    for entry in map.entries() {
        for disc in map.discs_in_own(entry.tile)? {
            let [x, y] = [0, 1].map(|k| ((disc.centre_in_own_m[k] - low_m[k]) / column_m) as usize);
            columns[y.min(height - 1) * width + x.min(width - 1)] = PlanColumn::Covered;
        }
    }
    Ok(GroundPlan { corner_m: low_m, column_m, width, columns })
}
