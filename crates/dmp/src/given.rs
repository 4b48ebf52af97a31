//! Maps that the user gives: stores and clouds.

use std::path::Path;

use dmp_log::read_cloud;
use dmp_map::{FuseScratch, Lattice, MapFuser, Store};

use crate::config::{Config, MapSource, Run};
use crate::error::EvaluateError;
use crate::watch::{Stage, Watch};

/// Refuses given maps where trails are to be kept out of maps.
pub(crate) fn check_free_space(runs: &[Run], config: &Config) -> Result<(), EvaluateError> {
    match runs.iter().find(|run| config.free_space && run.map != MapSource::Fused) {
        Some(run) => Err(EvaluateError::Setting {
            setting: "free-space",
            value: format!("with a map given for `{}`", run.name),
            why: "it needs maps that are fused from the scans; leave --map or --free-space out",
        }),
        None => Ok(()),
    }
}

/// Opens the stores among the given maps; `None` for the other runs.
///
/// Before anything else, so that stores with other voxels are refused before a long log is read.
pub(crate) fn given_stores(runs: &[Run]) -> Result<Vec<Option<Store>>, EvaluateError> {
    let open = |run: &Run| match &run.map {
        MapSource::Given(path) if is_store(path) => {
            Store::open(path).map(Some).map_err(EvaluateError::map_of(&run.name))
        }
        _ => Ok(None),
    };
    runs.iter().map(open).collect()
}

/// The voxel edge that the given stores have, metres; `None` where none is given.
pub(crate) fn voxel_of_stores(
    runs: &[Run],
    stores: &[Option<Store>],
    asked_m: Option<f64>,
) -> Result<Option<f64>, EvaluateError> {
    let mut given: Option<(&Run, f64)> = None;
    for (run, store) in runs.iter().zip(stores) {
        let Some(store) = store else { continue };
        let voxel_m = store.lattice().voxel_m();
        match given {
            Some((other, other_m)) if other_m != voxel_m => {
                return Err(EvaluateError::DifferentVoxels {
                    a: other.name.clone(),
                    b: run.name.clone(),
                    a_m: other_m,
                    b_m: voxel_m,
                });
            }
            _ => given = Some((run, voxel_m)),
        }
    }
    if let (Some((_, given_m)), Some(asked_m)) = (given, asked_m)
        && Lattice::new(asked_m).map_err(EvaluateError::Work)?.voxel_m() != given_m
    {
        return Err(EvaluateError::Setting {
            setting: "voxel",
            value: format!("{asked_m} m"),
            why: "a given map has voxels of another edge; leave --voxel out to take that",
        });
    }
    Ok(given.map(|(_, voxel_m)| voxel_m))
}

fn is_store(path: &Path) -> bool {
    // Whatever is wrong with the file is better said by the one that reads it as a whole.
    !matches!(Store::open(path), Err(dmp_map::MapError::NotAStore { .. } | dmp_map::MapError::Io { .. }))
}

/// Fuses a cloud, whose points know no segment. Answers how many points were not finite.
pub(crate) fn fuse_cloud(
    path: &Path,
    run: &str,
    fuser: &MapFuser,
    watch: &dyn Watch,
) -> Result<u64, EvaluateError> {
    let mut buffers = FuseScratch::default();
    let mut finite = Vec::new();
    let mut dropped = 0;
    watch.begin(Stage::ReadMap, 0);
    read_cloud(path, |batch| {
        finite.clear();
        finite.extend(batch.iter().filter(|point| point.iter().all(|c| c.is_finite())));
        dropped += (batch.len() - finite.len()) as u64;
        watch.advance(batch.len() as u64);
        if watch.cancelled() {
            return Err(EvaluateError::Cancelled);
        }
        fuser.add(&finite, None, &mut buffers).map_err(EvaluateError::map_of(run))
    })?;
    Ok(dropped)
}
