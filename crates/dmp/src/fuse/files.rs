//! Where the files of maps go, how long they live, and how they end.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use dmp_map::{Durability, MapError, MapFuser, Origin, Store};

use crate::evaluation::Evaluation;
use crate::progress::{Progress, Stage};
use crate::run_state::RunState;
use crate::work::Round;

/// How long a finished map is to live.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Life {
    /// Until nobody reads it any more.
    Reader,
    /// As long as the work folder.
    Work,
    /// It is the user's.
    User,
}

impl<M> Evaluation<'_, M> {
    /// Where the partial sums of a run go.
    pub(super) fn scratch_file<N>(&self, round: Round, run: &RunState<'_, N>) -> PathBuf {
        self.work.file(&format!("{}.{}", run.file_stem, scratch_extension(round)))
    }

    /// How long maps live that are not saved.
    pub(super) fn life(&self) -> Life {
        if self.work.every().is_some() { Life::Work } else { Life::Reader }
    }

    /// Where the fused map of a run goes.
    pub(super) fn map_file<N>(&self, round: Round, run: &RunState<'_, N>) -> (PathBuf, Life) {
        let stem = &run.file_stem;
        // Maps that are fused once more without trails are saved then.
        let is_last = round == Round::WithoutTrails || !self.settings.free_space;
        match (&self.means.save_maps, round) {
            (Some(folder), _) if is_last => (folder.join(format!("{stem}.dmpmap")), Life::User),
            (_, Round::First) => (self.work.file(&format!("{stem}.dmpmap")), self.life()),
            (_, Round::WithoutTrails) => {
                (self.work.file(&format!("{stem}.without-trails.dmpmap")), self.life())
            }
        }
    }

    /// Where the map goes that is made of a cloud of a run.
    pub(super) fn given_map_file<N>(&self, run: &RunState<'_, N>) -> PathBuf {
        self.work.file(&format!("given-{}.dmpmap", run.file_stem))
    }
}

/// Ends the names of scratch files.
pub(super) fn scratch_extension(round: Round) -> &'static str {
    match round {
        Round::First => "scratch",
        Round::WithoutTrails => "scratch-without-trails",
    }
}

/// Makes surfels of what is fused and writes them to `path`; the map, and the occupied voxels without a surfel.
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
