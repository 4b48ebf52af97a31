//! Finished maps as they are kept for another process, and taken up by it.

use std::path::PathBuf;

use dmp_map::Store;

use super::files::scratch_extension;
use crate::error::EvaluateError;
use crate::evaluation::{Evaluation, FuseTotals};
use crate::run_map::RunMap;
use crate::run_state::RunState;
use crate::work::{Fused, FusedMap, Fusing, Round, Work};

impl<'a> Evaluation<'a, Option<Store>> {
    /// With maps that an earlier process finished.
    pub(super) fn reopened(mut self, fused: Fused) -> Result<Evaluation<'a, RunMap>, EvaluateError> {
        let mut runs = Vec::new();
        for (run, FusedMap { path, facts }) in std::mem::take(&mut self.runs).into_iter().zip(fused.maps) {
            let (run, given) = run.with_map(());
            let store = match (given, path) {
                (Some(store), _) => store,
                (None, Some(path)) => Store::open(&path).map_err(EvaluateError::map_of(run.name()))?,
                (None, None) => continue,
            };
            runs.push(run.with_map(RunMap { store, facts }).0);
        }
        let Fused { counts, left_out, scratch_bytes, .. } = fused;
        self.fused = FuseTotals { counts, left_out, scratch_bytes };
        Ok(self.with_runs(runs))
    }
}

/// Finished maps, as they are kept.
pub(crate) struct KeptMaps {
    /// Whether they are those without trails.
    pub(crate) round: Round,
    fused: Fused,
}

impl KeptMaps {
    /// Keeps them, unless they are already, and forgets what they were made of.
    pub(crate) fn keep(&self, work: &Work) -> Result<(), EvaluateError> {
        if work.holds::<Fused>(self.round) {
            return Ok(());
        }
        for map in &self.fused.maps {
            map.path.as_ref().map_or(Ok(()), |path| work.sync(path))?;
        }
        work.save(self.round, &self.fused)?;
        work.forget::<Fusing>(self.round);
        work.remove_files(scratch_extension(self.round));
        Ok(())
    }
}

impl Evaluation<'_, RunMap> {
    /// Keeps finished maps where it is time to; returns how they are kept.
    pub(crate) fn keep_if_due(&self) -> Result<KeptMaps, EvaluateError> {
        // A store that was given is opened again where it was given.
        let path = |map: &RunMap| map.facts.thin_voxels.map(|_| map.store.path().to_path_buf());
        let kept = |run: &RunState<'_, RunMap>| -> FusedMap {
            let path: Option<PathBuf> = path(&run.map);
            FusedMap { path, facts: run.map.facts.clone() }
        };
        let FuseTotals { counts, left_out, scratch_bytes } = self.fused;
        let maps = self.runs.iter().map(kept).collect();
        let round = if self.has_trails_out() { Round::WithoutTrails } else { Round::First };
        let maps = KeptMaps { round, fused: Fused { counts, left_out, scratch_bytes, maps } };
        if self.work.due() {
            maps.keep(&self.work)?;
        }
        Ok(maps)
    }

    /// Whether the returns on trails are out of the maps.
    pub(super) fn has_trails_out(&self) -> bool {
        self.runs.iter().any(|run| run.map.facts.trails.is_some())
    }
}
