//! The cast stage: casts some scans into the maps.

use std::path::{Path, PathBuf};

use dmp::{EvaluateError, PlacedRun, PlannedScore};
use dmp_map::{Durability, Origin, Store, join_stores};
use dmp_reduce::FrameSet;

use super::error::ShardError;
use super::merge::{MergedPart, piece_name};
use super::opened::Shard;
use super::part::Part;
use super::stage::Stage;

impl Shard<'_> {
    /// Casts some scans into the maps of all runs and stores the sums. Returns the receipt file that marks
    /// the part as done.
    ///
    /// # Errors
    /// When the log or a piece of a map cannot be read, is missing, or differs from the plan.
    pub fn cast(&self, part: Part) -> Result<PathBuf, ShardError> {
        let planned = self.planned()?;
        let frames = Self::share(&planned, part, &planned.used_scans());
        let merged: Vec<(Part, MergedPart)> = self.folder.read(Stage::Merge)?;
        let map = |planned: &PlannedScore<'_>, run: usize, path: &Path| {
            let pieces = pieces_in_reach(planned, run, &merged, &frames)?;
            self.map_in_reach(planned, run, pieces, path)
        };
        let cast = planned.cast(&frames, map)?;
        self.folder.write(Stage::Cast, part, &cast)
    }

    /// Joins pieces of a run's map, at `path`.
    fn map_in_reach(
        &self,
        planned: &PlannedScore<'_>,
        run: usize,
        pieces: Vec<Part>,
        path: &Path,
    ) -> Result<Store, ShardError> {
        let run = planned.run(run);
        let of_run = |error| ShardError::Evaluate(EvaluateError::map_of(run.name)(error));
        let open = |part: Part| self.open_piece(part, &run);
        let pieces = pieces.into_iter().map(open).collect::<Result<Vec<_>, _>>()?;
        let origin = Origin { text: String::new(), own_from_world: run.own_from_world };
        join_stores(planned.lattice()?, &pieces, (path, &origin, Durability::Temporary)).map_err(of_run)?;
        Store::open_once(path).map_err(of_run)
    }

    fn open_piece(&self, part: Part, run: &PlacedRun<'_>) -> Result<Store, ShardError> {
        let path = self.folder.file(&piece_name(part, run.file_stem));
        let store = Store::open(&path).map_err(EvaluateError::map_of(run.name))?;
        let expected = self.piece_text(part, run.name);
        if store.origin().text != expected {
            return Err(ShardError::OtherPart { path, found: store.origin().text.clone(), expected });
        }
        Ok(store)
    }
}

/// The pieces of a run's map that rays from some frames may hit.
pub(super) fn pieces_in_reach(
    planned: &PlannedScore<'_>,
    run: usize,
    merged: &[(Part, MergedPart)],
    frames: &FrameSet,
) -> Result<Vec<Part>, ShardError> {
    let reach = planned.reach(run, frames)?;
    let is_met = |merged: &MergedPart| {
        merged.pieces.get(run).is_some_and(|piece| piece.is_some_and(|piece| reach.meets(&piece.span())))
    };
    Ok(merged.iter().filter(|(_, merged)| is_met(merged)).map(|(part, _)| *part).collect())
}
