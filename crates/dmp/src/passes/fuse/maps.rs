//! The maps of all runs: fused from the scans in one pass over the log, or given.

use std::path::Path;
use std::sync::Arc;

use dmp_log::shown_path;
use dmp_map::{Lattice, MapFuser, Origin, Store};
use dmp_runs::{EvaluateError, MapSource, PosedRun};

use super::checkpoint::{Fused, Fusing};
use super::files::{Finished, finish};
use super::pass::{FusePass, Making};
use crate::drawn::{Choice, DrawnScans, Followed, KeptReturns};
use crate::means::peak;
use crate::passes::evaluation::Evaluation;
use crate::passes::given::fuse_given;
use crate::passes::run_map::{MapFacts, RunMap};

impl<'a> Evaluation<'a, Option<Store>> {
    /// Makes the map of every run. Resumes from an earlier process's checkpoint.
    ///
    /// # Errors
    /// When the log or a given map cannot be read, or a map not be written.
    pub(crate) fn fuse(self) -> Result<Evaluation<'a, RunMap>, EvaluateError> {
        let work = Arc::clone(&self.work);
        if let Some(fused) = work.load::<Fused>()? {
            return self.reopened(fused);
        }
        let mut before = work.load::<Fusing>()?.unwrap_or_default();
        let states = std::mem::take(&mut before.fusers);
        let mut making = work.install(|| self.begin(states, Self::given_map))?;
        if making.runs.iter().any(|run| matches!(run.map, Making::Scans(_))) {
            making.kept = making.kept_returns()?;
            making.fused.counts = Some(FusePass { evaluation: &making, frames: None }.run(&before)?);
        }
        making.fused.scratch_bytes += making.kept.all().map(DrawnScans::bytes).sum::<u64>();
        work.install(|| making.finish())
    }

    /// Begins the maps, or resumes from the states that an earlier process fused. Given maps, a store or a
    /// file, come first: their errors show before the log is read.
    pub(super) fn begin<G>(
        mut self,
        states: Vec<Option<Vec<u8>>>,
        given: impl Fn(&Self, &PosedRun<'a, ()>, &Path, Option<Store>) -> Result<G, EvaluateError>,
    ) -> Result<Evaluation<'a, Making<G>>, EvaluateError> {
        let (lattice, budget_bytes) = (self.lattice()?, self.map_bytes());
        let runs = std::mem::take(&mut self.runs);
        let begin_given = |run: PosedRun<'a, Option<Store>>| {
            let (run, store) = run.with_map(());
            let map = match &run.run.map {
                MapSource::Given(file) => Some(given(&self, &run, file, store)?),
                MapSource::Fused => None,
            };
            Ok(run.with_map(map).0)
        };
        let runs: Vec<_> = runs.into_iter().map(begin_given).collect::<Result<_, EvaluateError>>()?;
        let begin_scans = |(run, state): (PosedRun<'a, Option<G>>, Option<Vec<u8>>)| {
            let (run, map) = run.with_map(());
            let making = match (map, state) {
                (Some(map), _) => Making::Given(map),
                (None, Some(state)) => {
                    let scratch = self.scratch_file(&run);
                    let fuser = MapFuser::resume(lattice, budget_bytes, &scratch, &state);
                    Making::Scans(fuser.map_err(EvaluateError::map_of(run.name()))?)
                }
                (None, None) => Making::Scans(self.new_fuser(&run, budget_bytes)?),
            };
            Ok(run.with_map(making).0)
        };
        let states = states.into_iter().chain(std::iter::repeat(None));
        let runs = runs.into_iter().zip(states).map(begin_scans).collect::<Result<_, EvaluateError>>()?;
        Ok(self.with_runs(runs))
    }
}

impl<M> Evaluation<'_, M> {
    /// What is kept of the scans while they are fused: of a long log, whose returns are not all cast. A short one is read again.
    pub(crate) fn to_keep(&self) -> [Option<Choice>; 2] {
        let plan = &self.plan;
        let chosen = [Choice::ToFollow(Followed::of(plan.frames())), Choice::ToCast(plan.draw)];
        chosen.map(|choice| (plan.draw.one_in() > 1).then_some(choice))
    }

    fn kept_returns(&self) -> Result<KeptReturns, EvaluateError> {
        let (scans, has_checksums) = (self.plan.frames().len(), self.log.summary().has_checksums);
        let kept = |choice| DrawnScans::new(choice, scans, self.work.path()).map(Arc::new);
        let [to_follow, to_cast] = self.to_keep().map(|choice| choice.map(kept).transpose());
        Ok(KeptReturns { has_checksums, to_follow: to_follow?, to_cast: to_cast? })
    }

    pub(crate) fn lattice(&self) -> Result<Lattice, EvaluateError> {
        Ok(Lattice::new(self.plan.surveyed.voxel_m)?)
    }

    /// Memory for each map that is fused from the scans.
    fn map_bytes(&self) -> usize {
        let fused = self.runs.iter().filter(|run| run.run.map == MapSource::Fused).count();
        self.work.budget().map_bytes(fused)
    }

    fn new_fuser<N>(&self, run: &PosedRun<'_, N>, budget_bytes: usize) -> Result<MapFuser, EvaluateError> {
        let lattice = self.lattice()?;
        let fuser = if self.work.every().is_some() {
            MapFuser::with_scratch(lattice, budget_bytes, &self.scratch_file(run))
        } else {
            MapFuser::new(lattice, budget_bytes, self.work.path())
        };
        fuser.map_err(EvaluateError::map_of(run.name()))
    }

    /// The given map: a store as it is, or the map of a cloud or a mesh.
    fn given_map(
        &self,
        run: &PosedRun<'_, ()>,
        file: &Path,
        store: Option<Store>,
    ) -> Result<RunMap, EvaluateError> {
        if let Some(store) = store {
            return Ok(RunMap { store, facts: MapFacts::default() });
        }
        // One at a time, never resumed.
        let budget_bytes = self.work.budget().map_bytes(1);
        let fuser = MapFuser::new(self.lattice()?, budget_bytes, self.work.path());
        let fuser = fuser.map_err(EvaluateError::map_of(run.name()))?;
        let world_from_own = run.own_from_world.inverse();
        let into = (&fuser, &world_from_own);
        let found = fuse_given(file, run.name(), self.settings.map_unit, into, self.progress)?;
        let origin = origin(run, format!("fused from {}", shown_path(file)));
        let finished = finish(fuser, &self.given_map_file(run), &origin, (self.life(), 0), self.progress);
        // How thick a given map is does not depend on the run.
        let Finished { store, thin_voxels, .. } = finished.map_err(EvaluateError::map_of(run.name()))?;
        let (thin_voxels, points_dropped) = (Some(thin_voxels), found.dropped);
        EvaluateError::if_empty(file, &store, thin_voxels, points_dropped)?;
        let notes = found.notes;
        let facts = MapFacts { thin_voxels, points_dropped, notes, ..MapFacts::default() };
        Ok(RunMap { store, facts })
    }
}

/// The origin of a run's map, in words, and its frame.
fn origin<M>(run: &PosedRun<'_, M>, text: String) -> Origin {
    Origin { text, own_from_world: run.own_from_world }
}

impl<'a> Evaluation<'a, Making<RunMap>> {
    /// Computes the surfels, run by run.
    fn finish(mut self) -> Result<Evaluation<'a, RunMap>, EvaluateError> {
        let mut runs = Vec::new();
        for run in std::mem::take(&mut self.runs) {
            let (run, making) = run.with_map(());
            let map = match making {
                Making::Scans(fuser) => {
                    self.fused.scratch_bytes += fuser.scratch_bytes();
                    let (path, life) = self.fused_file(&run);
                    let origin = origin(&run, self.provenance(&run));
                    let reach = run.path.revisit_reach(self.settings.scales.lengths().pass_m);
                    let finished = finish(fuser, &path, &origin, (life, reach), self.progress);
                    let Finished { store, thin_voxels, thickness } =
                        finished.map_err(EvaluateError::map_of(run.name()))?;
                    let thin_voxels = Some(thin_voxels);
                    let facts = MapFacts { fused: true, thin_voxels, thickness, ..MapFacts::default() };
                    RunMap { store, facts }
                }
                Making::Given(map) => map,
            };
            runs.push(run.with_map(map).0);
            peak::look();
        }
        Ok(self.with_runs(runs))
    }

    fn provenance(&self, run: &PosedRun<'_, ()>) -> String {
        let summary = self.log.summary();
        format!(
            "dmp {}; log {} ({}); run {}; {} scans, {} segments",
            env!("CARGO_PKG_VERSION"),
            shown_path(&summary.path),
            summary.fingerprint,
            run.name(),
            (0..self.plan.frames().len()).filter(|&ordinal| run.path.has(ordinal)).count(),
            run.path.segments.starts.len()
        )
    }
}
