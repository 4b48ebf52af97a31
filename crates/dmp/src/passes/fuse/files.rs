//! Paths, lifetimes and completion of map files.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use dmp_map::{Durability, MapError, MapFuser, Origin, Store};
use dmp_runs::{PosedRun, Progress, Stage};

use crate::means::Round;
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

impl<M> Evaluation<'_, M> {
    /// Path of the partial sums of a run.
    pub(super) fn scratch_file<N>(&self, round: Round, run: &PosedRun<'_, N>) -> PathBuf {
        self.work.file(&format!("{}.{}", run.file_stem, scratch_extension(round)))
    }

    /// The lifetime of maps that are not saved.
    pub(super) fn life(&self) -> Life {
        if self.work.every().is_some() { Life::Work } else { Life::Reader }
    }

    /// Path and lifetime of the fused map of a run.
    pub(super) fn map_file<N>(&self, round: Round, run: &PosedRun<'_, N>) -> (PathBuf, Life) {
        let stem = &run.file_stem;
        // With `free_space`, the maps fused again without trails are the ones to save.
        let is_last = round == Round::WithoutTrails || !self.settings.free_space;
        match (&self.means.save_maps, round) {
            (Some(folder), _) if is_last => (folder.join(format!("{stem}.dmpmap")), Life::User),
            (_, Round::First) => (self.work.file(&format!("{stem}.dmpmap")), self.life()),
            (_, Round::WithoutTrails) => {
                (self.work.file(&format!("{stem}.without-trails.dmpmap")), self.life())
            }
        }
    }

    /// Path of the map made of a run's cloud.
    pub(super) fn given_map_file<N>(&self, run: &PosedRun<'_, N>) -> PathBuf {
        self.work.file(&format!("given-{}.dmpmap", run.file_stem))
    }
}

/// The extension of scratch files.
pub(super) fn scratch_extension(round: Round) -> &'static str {
    match round {
        Round::First => "scratch",
        Round::WithoutTrails => "scratch-without-trails",
    }
}

/// Computes surfels from the fused sums and writes them to `path`; returns the map and the number of occupied
/// voxels without a surfel.
///
/// # Errors
/// When it cannot be written.
pub(crate) fn finish(
    fuser: MapFuser,
    path: &Path,
    origin: &Origin,
    life: Life,
    progress: &dyn Progress,
) -> Result<(Store, u64), MapError> {
    let done = AtomicU64::new(0);
    let durability = if life == Life::User { Durability::Durable } else { Durability::Temporary };
    let summary = fuser.finish(path, origin, durability, &|tiles, total| {
        let before = done.swap(tiles, Ordering::Relaxed);
        if before == 0 {
            progress.begin(Stage::Surfels, total);
        }
        progress.advance(tiles - before);
    })?;
    let store = match life {
        Life::Reader => Store::open_once(&summary.path)?,
        Life::Work | Life::User => Store::open(&summary.path)?,
    };
    Ok((store, summary.thin_voxels))
}
