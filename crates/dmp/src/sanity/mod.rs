//! Whether a map that was given is where the trajectory is, looked at on a few scans before all are cast. It changes no score.
//! Whether trajectories belong to the log is found before: `vet`.

mod doubts;
mod extent;
mod sample;

use dmp_cast::{Answer, CastBuffers, Caster};
use dmp_lengths::thousands;
use dmp_sensor::Ray;

use crate::error::EvaluateError;
use crate::maps::sparse;
use crate::poser::query_of;
use crate::progress::Stage;
use crate::run_state::RunState;
use crate::work::MapFacts;
pub(crate) use doubts::Doubts;
use extent::Extent;
use sample::Sample;

/// A return this near to a surface of a given map is where the map has one, metres of a drive, and a map in which fewer
/// returns are is hardly of this world.
const FIT_M: f64 = 0.5;
const NEARLY_NOTHING: f64 = 0.25;

impl Doubts<'_> {
    /// Says of every run whose map was `given` whether that is hardly the one of the trajectory, in words; notes
    /// too.
    ///
    /// # Errors
    /// When the log or a map cannot be read.
    pub(crate) fn look<M>(
        &self,
        runs: &mut [RunState<'_, M>],
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

/// One run, looked at.
struct Look<'a, M> {
    sample: &'a Sample,
    doubts: &'a Doubts<'a>,
    run: &'a RunState<'a, M>,
}

impl<M> Look<'_, M> {
    /// Whether a map that was given is where the trajectory is.
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

    /// Share of the sample's returns with a surface of the map where they were measured.
    fn share_in_map(&self, caster: &Caster) -> Result<f64, EvaluateError> {
        let (mut queries, mut answers, mut buffers) = (Vec::new(), Vec::new(), CastBuffers::default());
        let mut found = 0_usize;
        let fit_m = FIT_M * self.doubts.settings.metre_m();
        self.sample.rays(&self.run.poses, &self.doubts.plan.filter, |rays| {
            queries.clear();
            queries.extend(rays.iter().map(|ray| query_of(ray, None)));
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
