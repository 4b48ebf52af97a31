//! Whether log, trajectory and map belong together, looked at on a few scans before all are cast; and what
//! is most likely wrong where they do not. It changes no score. `docs/metric.md` says what was measured.

mod alternatives;
mod doubts;
mod extent;
mod sample;

use std::sync::Arc;

use dmp_cast::{Answer, CastBuffers, Caster};
use dmp_sensor::Ray;

use crate::error::EvaluateError;
use crate::frames::PlannedFrame;
use crate::pairing::Pairing;
use crate::pose::query_of;
use crate::progress::Stage;
use crate::run_state::RunState;
use alternatives::{Alternative, all, inverted};
pub(crate) use doubts::Doubts;
use extent::Extent;
pub(crate) use sample::stretches;
use sample::{Fit, Sample};

/// Another reading is told when the scans fit together better by this factor and this share with it. Right
/// inputs gain less than a hundredth by any, wrong ones half as much again and more.
const BETTER_BY: f64 = 1.25;
const BETTER_BY_SHARE: f64 = 0.1;
/// A time at which the vehicle goes less far than this part of its way proves nothing: scans of one place fit
/// together wherever that is.
const LEAST_WAY: f64 = 0.5;
/// A return this near to a surface of a given map is where the map has one, metres of a drive, and a map in which fewer
/// returns are is hardly of this world.
const FIT_M: f64 = 0.5;
const NEARLY_NOTHING: f64 = 0.25;

impl Doubts<'_> {
    /// Says of every run what is likely wrong with it by the scans of some `stretches` of the drive, in words; tells
    /// whoever watches too. `given` is the map of a run where it was not fused.
    ///
    /// # Errors
    /// When the log or a map cannot be read.
    pub(crate) fn look<M>(
        &self,
        stretches: &[&[PlannedFrame]],
        runs: &mut [RunState<'_, M>],
        given: impl Fn(&M) -> Option<&Caster>,
    ) -> Result<(), EvaluateError> {
        self.progress.begin(Stage::Survey, runs.len() as u64);
        let sample = Sample::read(self, stretches, runs)?;
        for run in runs {
            let look = Look { sample: &sample, doubts: self, run };
            let mut hint = look.at_poses()?;
            if let (None, Some(map)) = (&hint, given(&run.map)) {
                hint = look.at_map(map)?;
            }
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
    /// Whether its scans fit together much better when what the user gave is read another way.
    fn at_poses(&self) -> Result<Option<String>, EvaluateError> {
        let Self { sample, doubts: Doubts { log, plan, settings, .. }, run } = self;
        let filter = &plan.filter;
        let body_from_sensor = settings.body_from_sensor(run.run);
        let as_given = Arc::new(run.run.trajectory.clone());
        let given = sample.fit(&run.poses.along(&as_given, body_from_sensor), filter, 0)?;
        let turned_round = inverted(&as_given).map(Arc::new);
        let mut best: Option<(Fit, Alternative)> = None;
        let stamped = run.poses.pairing == Pairing::ByStamp;
        for alternative in all(body_from_sensor, stamped, log.summary()) {
            let trajectory = match &turned_round {
                Some(inverted) if alternative.inverted => inverted,
                _ => &as_given,
            };
            let poses = run.poses.along(trajectory, alternative.body_from_sensor);
            let fit = sample.fit(&poses, filter, alternative.shift_ns)?;
            let stands = alternative.shift_ns != 0 && fit.way_m < LEAST_WAY * given.way_m;
            if !stands && best.as_ref().is_none_or(|(best, _)| fit.together > best.together) {
                best = Some((fit, alternative));
            }
        }
        let better = |fit: &Fit| {
            fit.together > BETTER_BY * given.together && fit.together > BETTER_BY_SHARE + given.together
        };
        Ok(best.filter(|(fit, _)| better(fit)).map(|(fit, alternative)| {
            format!(
                "only {:.0} % of the returns of {} scans meet those of other scans near by; with {} {:.0} % do: {}",
                100.0 * given.together,
                sample.scans,
                alternative.with,
                100.0 * fit.together,
                alternative.ask
            )
        }))
    }

    /// Whether a map that was given is where the trajectory is.
    fn at_map(&self, caster: &Caster) -> Result<Option<String>, EvaluateError> {
        let own_from_world = caster.map().own_from_world();
        let places = self.doubts.plan.frames().iter().filter_map(|frame| self.run.poses.of_frame(frame));
        let places = places.map(|pose| (own_from_world * pose).translation.vector.into());
        let drive = Extent::of_points(places);
        let Some((drive, map)) = drive.zip(Extent::of_store(caster.map())) else { return Ok(None) };
        let gap_m = drive.gap_m(&map);
        if gap_m > self.doubts.settings.max_range_m {
            return Ok(Some(format!(
                "the trajectory is around {}, the map around {}, {gap_m:.0} m apart: is the map in the trajectory's frame?",
                drive.centre_in_words(),
                map.centre_in_words()
            )));
        }
        let share = self.share_in_map(caster)?;
        Ok((share < NEARLY_NOTHING).then(|| {
            format!(
                "only {:.0} % of the returns of {} scans are where its map has a surface: is the map in the trajectory's frame, and its unit right (--map-unit)?",
                100.0 * share,
                self.sample.scans
            )
        }))
    }

    /// Share of the sample's returns with a surface of the map where they were measured.
    fn share_in_map(&self, caster: &Caster) -> Result<f64, EvaluateError> {
        let (mut queries, mut answers, mut buffers) = (Vec::new(), Vec::new(), CastBuffers::default());
        let mut found = 0_usize;
        let fit_m = FIT_M * self.doubts.settings.metre_m();
        self.sample.rays(&self.run.poses, &self.doubts.plan.filter, 0, |_, rays| {
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
        Ok(found as f64 / self.sample.returns.max(1) as f64)
    }
}
