//! Finished maps in a checkpoint, and how they are resumed.

use dmp_map::Store;
use dmp_runs::{EvaluateError, PosedRun};

use super::checkpoint::{Fused, FusedMap, Fusing};
use super::files::SCRATCH;
use crate::means::Work;
use crate::passes::evaluation::{Evaluation, FuseTotals};
use crate::passes::run_map::RunMap;

impl<'a> Evaluation<'a, Option<Store>> {
    /// The evaluation with maps that an earlier process finished.
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
        let Fused { counts, scratch_bytes, .. } = fused;
        self.fused = FuseTotals { counts, scratch_bytes };
        Ok(self.with_runs(runs))
    }
}

/// Finished maps, as in a checkpoint.
pub(crate) struct KeptMaps {
    fused: Fused,
}

impl KeptMaps {
    /// Writes them, unless already written, and deletes the sums they were made from.
    pub(crate) fn keep(&self, work: &Work) -> Result<(), EvaluateError> {
        if work.holds::<Fused>() {
            return Ok(());
        }
        self.save(work)
    }

    /// Writes them, in the place of others if there are any.
    pub(crate) fn save(&self, work: &Work) -> Result<(), EvaluateError> {
        for map in &self.fused.maps {
            map.path.as_ref().map_or(Ok(()), |path| work.sync(path))?;
        }
        work.save(&self.fused)?;
        work.forget::<Fusing>();
        work.remove_files(SCRATCH);
        Ok(())
    }
}

impl Evaluation<'_, RunMap> {
    /// Checkpoints finished maps when due; returns how they are stored.
    pub(crate) fn keep_if_due(&self) -> Result<KeptMaps, EvaluateError> {
        let maps = self.kept_maps();
        if self.work.due() {
            maps.keep(&self.work)?;
        }
        Ok(maps)
    }

    /// Finished maps, as they are stored.
    pub(crate) fn kept_maps(&self) -> KeptMaps {
        // A given store is opened again at its own path.
        let path = |map: &RunMap| map.facts.thin_voxels.map(|_| map.store.path().to_path_buf());
        let kept =
            |run: &PosedRun<'_, RunMap>| FusedMap { path: path(&run.map), facts: run.map.facts.clone() };
        let FuseTotals { counts, scratch_bytes } = self.fused;
        KeptMaps { fused: Fused { counts, scratch_bytes, maps: self.runs.iter().map(kept).collect() } }
    }
}
