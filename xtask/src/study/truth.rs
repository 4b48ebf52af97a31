//! Errors of an estimate against the truth, with the defaults of evo.

use anyhow::Context as _;
use dmp_sensor::{Isometry3, Trajectory};
use dmp_truth::surface::{EvaluatedPoints, SurfaceSettings};
use dmp_truth::trajectory::{
    Alignment, DeltaUnit, Matching, PairOptions, PosePath, Preparation, Relation, Statistics, absolute,
    relative,
};

/// Poses match whose stamps differ by at most this, seconds.
const MAX_DIFF_S: f64 = 0.01;
/// Length of the steps of RPE, metres.
const STEP_M: f64 = 1.0;

/// An estimate against the truth.
#[derive(Debug)]
pub(super) struct TrueErrors {
    pub(super) ate_m: f64,
    /// `None` on a drive shorter than a step.
    pub(super) rpe_m: Option<f64>,
    /// The best rigid alignment.
    pub(super) truth_from_run: Isometry3<f64>,
}

impl TrueErrors {
    /// `evo_ape tum --align` and `evo_rpe tum --delta 1 --delta_unit m`.
    pub(super) fn of(estimate: &Trajectory, truth: &Trajectory) -> anyhow::Result<Self> {
        let preparation = Preparation {
            matching: Matching { max_diff_s: MAX_DIFF_S, ..Matching::default() },
            alignment: Alignment { pose: true, ..Alignment::default() },
            ..Preparation::default()
        };
        let both = preparation.apply(PosePath::of(truth)?, &PosePath::of(estimate)?)?;
        let places = absolute(&both.reference, &both.estimate, Relation::TranslationPart)?;
        let pairs = PairOptions { delta: STEP_M, unit: DeltaUnit::Meters, ..PairOptions::default() };
        let steps = relative(&both.reference, &both.estimate, Relation::TranslationPart, &pairs);
        let rmse = |values: &[f64]| Statistics::of(values).map(|statistics| statistics.rmse);
        Ok(Self {
            ate_m: rmse(&places.values).context("no pose has a partner")?,
            rpe_m: steps.ok().and_then(|steps| rmse(&steps.values)),
            truth_from_run: both.moved_by.context("no alignment")?.isometry(),
        })
    }

    /// The mean distance of a run's points from the true surface, metres; more than a metre counts as one.
    pub(super) fn surface_distance_m(&self, cloud: &[[f64; 3]], surface: &[[f64; 3]]) -> anyhow::Result<f64> {
        let settings = SurfaceSettings { thresholds_m: Vec::new(), ..SurfaceSettings::default() };
        let mut points = EvaluatedPoints::new(&settings, self.truth_from_run)?;
        points.add(cloud)?;
        let mut reference = points.against_reference()?;
        reference.add_points(surface)?;
        Ok(reference.measure(&())?.accuracy.mean_m)
    }
}
