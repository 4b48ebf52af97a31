//! The study's view of ground truth.

use dmp_sensor::{Isometry3, Trajectory};
use dmp_truth::surface::{EvaluatedPoints, Reference, SurfaceError, SurfaceSettings};
use dmp_truth::trajectory::{
    Alignment, CompareError, DeltaUnit, Matching, PairOptions, PosePath, Preparation, Relation, Statistics,
    absolute, relative,
};

/// Hands the triangles or points of the reference surface over, in the frame of the reference trajectory.
/// Called once for every run.
pub type ReferenceSurface<'a> =
    dyn Fn(&mut Reference) -> Result<(), Box<dyn std::error::Error + Send + Sync>> + 'a;

/// Why a surface distance cannot be told.
#[derive(Debug, thiserror::Error)]
pub(crate) enum SurfaceProblem {
    #[error(transparent)]
    Measuring(Box<SurfaceError>),
    #[error(transparent)]
    Reading(#[from] Box<dyn std::error::Error + Send + Sync>),
}

impl From<SurfaceError> for SurfaceProblem {
    fn from(error: SurfaceError) -> Self {
        Self::Measuring(Box::new(error))
    }
}

/// How runs are compared with the reference trajectory. The default is what `evo_ape tum --align` and
/// `evo_rpe tum --delta 1 --delta_unit m` do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TruthOptions {
    /// Poses belong together when their stamps are nearest and at most so far apart, seconds.
    pub max_diff_s: f64,
    /// Way between the poses of a relative error, metres.
    pub rpe_delta_m: f64,
}

impl Default for TruthOptions {
    fn default() -> Self {
        Self { max_diff_s: 0.01, rpe_delta_m: 1.0 }
    }
}

/// A run against the reference.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TrajectoryErrors {
    /// Poses that have a partner.
    pub(crate) poses: usize,
    /// Root mean square distance of the places after the best rigid alignment, metres.
    pub(crate) ate_rmse_m: f64,
    /// What moves the run's world into the reference's.
    pub(crate) reference_from_run: Isometry3<f64>,
    /// Root mean square error of the relative translations, metres; or why there is none.
    pub(crate) rpe_rmse_m: Result<f64, CompareError>,
}

/// ATE and RPE of a run.
///
/// # Errors
/// When the two have no poses in common, or too few to be aligned.
pub(crate) fn trajectory_errors(
    reference: &Trajectory,
    estimate: &Trajectory,
    options: &TruthOptions,
) -> Result<TrajectoryErrors, CompareError> {
    let preparation = Preparation {
        matching: Matching { max_diff_s: options.max_diff_s, ..Matching::default() },
        alignment: Alignment { pose: true, ..Alignment::default() },
        ..Preparation::default()
    };
    let prepared = preparation.apply(PosePath::of(reference)?, PosePath::of(estimate)?)?;
    let places = absolute(&prepared.reference, &prepared.estimate, Relation::TranslationPart)?;
    let pairs = PairOptions { delta: options.rpe_delta_m, unit: DeltaUnit::Meters, ..PairOptions::default() };
    let steps = relative(&prepared.reference, &prepared.estimate, Relation::TranslationPart, &pairs);
    Ok(TrajectoryErrors {
        poses: places.values.len(),
        ate_rmse_m: rmse(&places.values),
        reference_from_run: prepared.moved_by.ok_or(CompareError::NothingToAlign)?.isometry(),
        rpe_rmse_m: steps.map(|steps| rmse(&steps.values)),
    })
}

/// Mean and median distance of a cloud from the reference surface, metres.
pub(crate) fn surface_distances(
    cloud: &[[f64; 3]],
    reference_from_run: Isometry3<f64>,
    surface: &ReferenceSurface<'_>,
    settings: &SurfaceSettings,
) -> Result<(f64, f64), SurfaceProblem> {
    let mut points = EvaluatedPoints::new(settings, reference_from_run)?;
    points.add(cloud)?;
    let mut reference = points.against_reference()?;
    surface(&mut reference)?;
    let accuracy = reference.measure(&())?.accuracy;
    Ok((accuracy.mean_m, accuracy.median_m))
}

fn rmse(values: &[f64]) -> f64 {
    Statistics::of(values).map_or(f64::NAN, |statistics| statistics.rmse)
}
