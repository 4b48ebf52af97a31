//! Checks on a few scans, before the cast, that a given map fits its trajectory. It changes no score. `vet`
//! checks earlier that trajectories belong to the log.

mod doubts;
mod extent;
mod sample;

use dmp_cast::{Answer, CastBuffers, Caster, Query};
use dmp_lengths::thousands;
use dmp_runs::{EvaluateError, PosedRun, Stage};
use dmp_sensor::Ray;

use crate::passes::given::sparse;
use crate::passes::run_map::MapFacts;
pub(crate) use doubts::Doubts;
use extent::Extent;
use sample::Sample;

/// A return this near to a surface of a given map fits it, metres of a drive. Below this share of fitting
/// returns, the map probably is in another frame.
const FIT_M: f64 = 0.5;
const NEARLY_NOTHING: f64 = 0.25;

impl Doubts<'_> {
    /// Returns a warning for every run with a `given` map that seems not to fit its trajectory; also emits it
    /// as a note.
    ///
    /// # Errors
    /// When the log or a map cannot be read.
    pub(crate) fn look<M>(
        &self,
        runs: &mut [PosedRun<'_, M>],
        given: impl Fn(&M) -> Option<(&Caster, &MapFacts)>,
    ) -> Result<(), EvaluateError> {
        if runs.iter().all(|run| given(&run.map).is_none()) {
            return Ok(());
        }
        self.progress.begin(Stage::Survey, runs.len() as u64);
        let sample = Sample::read(self)?;
        for run in runs {
            let look = Look { sample: &sample, doubts: self, run };
            let hint = given(&run.map).map(|(map, facts)| look.at_map(map, facts)).transpose()?.flatten();
            if let Some(hint) = &hint {
                self.progress.note(&format!("run `{}`: {hint}", run.name()).into());
            }
            run.hint = hint;
            self.progress.advance(1);
        }
        Ok(())
    }
}

/// The check of one run.
struct Look<'a, M> {
    sample: &'a Sample,
    doubts: &'a Doubts<'a>,
    run: &'a PosedRun<'a, M>,
}

impl<M> Look<'_, M> {
    /// Whether a given map fits the trajectory.
    fn at_map(&self, caster: &Caster, facts: &MapFacts) -> Result<Option<String>, EvaluateError> {
        let own_from_world = caster.map().own_from_world();
        let places = self.doubts.plan.frames().iter().filter_map(|frame| self.run.poses.of_frame(frame));
        let places = places.map(|pose| (own_from_world * pose).translation.vector.into());
        let drive = Extent::of_points(places);
        let Some((drive, map)) = drive.zip(Extent::of_store(caster.map())) else { return Ok(None) };
        let gap_m = drive.gap_m(&map);
        if gap_m > self.doubts.settings.max_range_m {
            return Ok(Some(format!(
                "the trajectory is around {}, the map around {}, {} m apart: check that the map is in the trajectory's frame",
                drive.centre_in_words(),
                map.centre_in_words(),
                thousands(gap_m.round())
            )));
        }
        let share = self.share_in_map(caster)?;
        Ok((share < NEARLY_NOTHING).then(|| {
            let sparse = facts.thin_voxels.and_then(|thin_voxels| sparse(caster.map(), thin_voxels));
            format!(
                "only {:.0} % of the returns of {} scans are where its map has a surface: check the map's frame and unit{}",
                100.0 * share,
                thousands(self.sample.len()),
                sparse.map(|words| format!("; {words}")).unwrap_or_default()
            )
        }))
    }

    /// Share of the sample's returns at which the map has a surface.
    fn share_in_map(&self, caster: &Caster) -> Result<f64, EvaluateError> {
        let (mut queries, mut answers, mut buffers) = (Vec::new(), Vec::new(), CastBuffers::default());
        let mut found = 0_usize;
        let fit_m = FIT_M * self.doubts.settings.metre_m();
        self.sample.rays((&self.run.poses, &self.run.path), &self.doubts.plan.filter, |rays| {
            queries.clear();
            queries.extend(rays.iter().map(|&ray| Query { ray, segment: None }));
            let cast = caster.cast(&queries, &mut answers, &mut buffers);
            cast.map_err(EvaluateError::map_of(self.run.name()))?;
            let fits = |(ray, answer): &(&Ray, &Answer)| {
                answer.nearest_m.is_some_and(|nearest_m| (nearest_m - ray.range_m).abs() <= fit_m)
            };
            found += rays.iter().zip(&answers).filter(fits).count();
            Ok(())
        })?;
        Ok(found as f64 / self.sample.returns().max(1) as f64)
    }
}
