//! Paths, lifetimes and completion of map files.

use std::path::{Path, PathBuf};

use dmp_map::{Durability, MapError, MapFuser, Origin, Store, Thickness};
use dmp_runs::{PosedRun, Progress, Stage, so_far};

use crate::passes::evaluation::Evaluation;

/// The lifetime of a finished map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Life {
    /// Until the last reader closes it.
    Reader,
    /// As long as the work folder.
    Work,
    /// The user's: it stays.
    User,
}

impl Life {
    pub(crate) fn durability(self) -> Durability {
        if self == Self::User { Durability::Durable } else { Durability::Temporary }
    }

    /// Opens a map of this lifetime.
    pub(crate) fn open(self, path: &Path) -> Result<Store, MapError> {
        match self {
            Self::Reader => Store::open_once(path),
            Self::Work | Self::User => Store::open(path),
        }
    }
}

/// The extension of the files of partial sums.
pub(super) const SCRATCH: &str = "scratch";

impl<M> Evaluation<'_, M> {
    /// Path of the partial sums of a run.
    pub(super) fn scratch_file<N>(&self, run: &PosedRun<'_, N>) -> PathBuf {
        self.work.file(&format!("{}.{SCRATCH}", run.file_stem))
    }

    /// The lifetime of maps that are not saved.
    pub(super) fn life(&self) -> Life {
        if self.work.every().is_some() { Life::Work } else { Life::Reader }
    }

    /// Path and lifetime of the map of a run.
    pub(crate) fn map_file<N>(&self, run: &PosedRun<'_, N>) -> (PathBuf, Life) {
        let name = format!("{}.dmpmap", run.file_stem);
        match &self.means.save_maps {
            Some(folder) => (folder.join(name), Life::User),
            None => (self.work.file(&name), self.life()),
        }
    }

    /// Path and lifetime of the map as it is fused: with trails, which are then left out.
    pub(crate) fn fused_file<N>(&self, run: &PosedRun<'_, N>) -> (PathBuf, Life) {
        (self.work.file(&format!("{}.with-trails.dmpmap", run.file_stem)), self.life())
    }

    /// Path of the map made of a run's cloud.
    pub(super) fn given_map_file<N>(&self, run: &PosedRun<'_, N>) -> PathBuf {
        self.work.file(&format!("given-{}.dmpmap", run.file_stem))
    }
}

/// A map that was fused.
pub(crate) struct Finished {
    pub(crate) store: Store,
    /// Occupied voxels without a surfel.
    pub(crate) thin_voxels: u64,
    pub(crate) thickness: Option<Thickness>,
}

/// Computes surfels from the fused sums and writes them to `path`. Visits are more than `revisit_reach` segments apart.
///
/// # Errors
/// When it cannot be written.
pub(crate) fn finish(
    fuser: MapFuser,
    path: &Path,
    origin: &Origin,
    (life, revisit_reach): (Life, i32),
    progress: &dyn Progress,
) -> Result<Finished, MapError> {
    let lattice = *fuser.lattice();
    let summary = fuser.finish(path, origin, life.durability(), &so_far(progress, Stage::Surfels))?;
    let (store, thin_voxels) = (life.open(&summary.path)?, summary.thin_voxels);
    let own_from_world = *store.own_from_world();
    let thickness =
        summary.cells.thickness(&lattice, revisit_reach).map(|thickness| thickness.posed(&own_from_world));
    Ok(Finished { store, thin_voxels, thickness })
}
