//! The cast stage: casts some scans into the maps.

use std::path::PathBuf;

use dmp_map::{Durability, Origin, Store, join_stores};
use dmp_reduce::FrameSet;

use super::error::ShardError;
use super::merge::{MergedPart, piece_name};
use super::opened::Shard;
use super::part::Part;
use super::reach::Reach;
use super::stage::Stage;
use crate::cast::horizon_m;
use crate::error::EvaluateError;
use crate::evaluation::Evaluation;
use crate::run_map::RunMap;
use crate::run_state::RunState;
use crate::work::MapFacts;

impl<'a> Shard<'a> {
    /// Casts some scans into the maps of all runs and stores the sums. Returns the receipt file that marks
    /// the part as done.
    ///
    /// # Errors
    /// When the log or a piece of a map cannot be read, is missing, or differs from the plan.
    pub fn cast(&self, part: Part) -> Result<PathBuf, ShardError> {
        let planned = self.planned()?;
        let frames = self.cast_frames(&planned, part);
        let merged: Vec<(Part, MergedPart)> = self.folder.read(Stage::Merge)?;
        let (maps, tiles) = self.with_maps(planned, &merged, &frames)?.casters();
        let cast = maps.cast_part(&tiles, &frames)?;
        self.folder.write(Stage::Cast, part, &cast)
    }

    /// The frames that a part casts.
    pub(super) fn cast_frames<M>(&self, planned: &Evaluation<'_, M>, part: Part) -> FrameSet {
        let scored = scored_frames(planned);
        self.share(planned, part, |ordinal| scored.contains(ordinal))
    }

    /// The pieces of a run's map that rays from some frames may hit.
    pub(super) fn pieces_in_reach<M>(
        &self,
        planned: &Evaluation<'_, M>,
        run: usize,
        merged: &[(Part, MergedPart)],
        frames: &FrameSet,
    ) -> Result<Vec<Part>, ShardError> {
        let edge_m = self.lattice()?.tile_edge_m();
        let horizon_m = horizon_m(&planned.settings);
        let reach = Reach::of(&planned.plan, frames, &planned.runs[run].poses, edge_m, horizon_m);
        let is_met = |merged: &MergedPart| {
            merged.pieces.get(run).is_some_and(|piece| piece.is_some_and(|piece| reach.meets(&piece.span())))
        };
        Ok(merged.iter().filter(|(_, merged)| is_met(merged)).map(|(part, _)| *part).collect())
    }

    /// Assembles the maps within reach of rays from some frames.
    fn with_maps(
        &self,
        mut planned: Evaluation<'a, Option<Store>>,
        merged: &[(Part, MergedPart)],
        frames: &FrameSet,
    ) -> Result<Evaluation<'a, RunMap>, ShardError> {
        let mut maps = Vec::new();
        for number in 0..planned.runs.len() {
            let run = &planned.runs[number];
            let of_run = |error| ShardError::Evaluate(EvaluateError::map_of(run.name())(error));
            let open = |part: Part| self.open_piece(part, run);
            let pieces = self.pieces_in_reach(&planned, number, merged, frames)?;
            let pieces = pieces.into_iter().map(open).collect::<Result<Vec<_>, _>>()?;
            let path = planned.work.file(&format!("{}.dmpmap", run.file_stem));
            let origin = Origin { text: String::new(), own_from_world: run.own_from_world };
            let to = (path.as_path(), &origin, Durability::Temporary);
            join_stores(self.lattice()?, &pieces, to).map_err(of_run)?;
            let store = Store::open_once(&path).map_err(of_run)?;
            let facts = MapFacts { fused: true, ..MapFacts::default() };
            maps.push(RunMap { store, facts });
        }
        let runs = std::mem::take(&mut planned.runs).into_iter().zip(maps);
        let runs = runs.map(|(run, map)| run.with_map(map).0).collect();
        Ok(planned.with_runs(runs))
    }

    fn open_piece<M>(&self, part: Part, run: &RunState<'_, M>) -> Result<Store, ShardError> {
        let path = self.folder.file(&piece_name(part, &run.file_stem));
        let store = Store::open(&path).map_err(EvaluateError::map_of(run.name()))?;
        let expected = self.piece_text(part, run.name());
        if store.origin().text != expected {
            return Err(ShardError::OtherPart { path, found: store.origin().text.clone(), expected });
        }
        Ok(store)
    }
}

/// The scored frames that some run has a pose for: all, or those in the sample.
pub(super) fn scored_frames<M>(planned: &Evaluation<'_, M>) -> FrameSet {
    planned.plan.looks.frames(0).filter(|&ordinal| planned.uses(ordinal)).collect()
}
