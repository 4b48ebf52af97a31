//! What is told of the runs' maps by their points.

use dmp::{Config, EvaluateError, Progress, Run};
use dmp_truth::surface::SurfaceSettings;

use crate::clouds::RunClouds;
use crate::error::StudyError;
use crate::options::StudyOptions;
use crate::peers::{PeerOptions, mutually_orthogonal, orthogonal_subset};
use crate::truth::{ReferenceSurface, SurfaceProblem, TrajectoryErrors, surface_distances};

/// What comes after the evaluation can be stopped too, run by run.
pub(crate) fn go_on(progress: &dyn Progress) -> Result<(), EvaluateError> {
    if progress.cancelled() { Err(EvaluateError::Cancelled) } else { Ok(()) }
}

/// Mean and median surface distance of every run.
pub(crate) fn distances_of(
    runs: &[Run],
    errors: &[TrajectoryErrors],
    clouds: &RunClouds,
    surface: &ReferenceSurface<'_>,
    config: &Config,
    options: &StudyOptions,
    progress: &dyn Progress,
) -> Result<Vec<(f64, f64)>, StudyError> {
    let settings = SurfaceSettings {
        cap_m: options.surface_cap_m,
        thresholds_m: Vec::new(),
        memory_bytes: config.memory_bytes,
        threads: config.threads,
        work_folder: config.work_folder.clone(),
        ..SurfaceSettings::default()
    };
    let of_run = |((run, errors), cloud): ((&Run, &TrajectoryErrors), &Vec<[f64; 3]>)| {
        go_on(progress)?;
        let distances = surface_distances(cloud, errors.reference_from_run, surface, &settings);
        distances.map_err(|problem| match problem {
            SurfaceProblem::Measuring(source) => StudyError::Surface { run: run.name.clone(), source },
            SurfaceProblem::Reading(source) => StudyError::ReadSurface(source),
        })
    };
    runs.iter().zip(errors).zip(&clouds.clouds).map(of_run).collect()
}

/// MOM of every run and where its planes were found.
pub(crate) struct Mom {
    pub(crate) values: Vec<Option<f64>>,
    pub(crate) planes_from: Option<String>,
    pub(crate) returns: Option<[usize; 3]>,
}

/// MOM of every run, around the same returns: those of the run in whose first scans most are on planes at
/// right angles.
pub(crate) fn mom_of(
    runs: &[Run],
    clouds: &RunClouds,
    options: &PeerOptions,
    notes: &mut Vec<String>,
) -> Mom {
    let mut best = None;
    let mut why_not = None;
    for (run, scans) in clouds.first_scans.iter().enumerate() {
        match orthogonal_subset(scans, options) {
            Ok(subset) => {
                if best.as_ref().is_none_or(|(_, most): &(usize, _)| subset_count(most) < subset.count()) {
                    best = Some((run, subset.points));
                }
            }
            Err(why) => why_not = why_not.or(Some(why)),
        }
    }
    let Some((from, planes)) = best else {
        let why = why_not.map_or_else(String::new, |why| format!(": {why}"));
        notes.push(format!("there is no MOM, for the first scans have no planes at right angles{why}"));
        return Mom { values: vec![None; runs.len()], planes_from: None, returns: None };
    };
    let of_run = |(scans, cloud): (&Vec<[f64; 3]>, &Vec<[f64; 3]>)| {
        let places = planes.each_ref().map(|points| points.iter().map(|&k| scans[k]).collect::<Vec<_>>());
        mutually_orthogonal(cloud, &places, options)
    };
    Mom {
        values: clouds.first_scans.iter().zip(&clouds.clouds).map(of_run).collect(),
        planes_from: Some(runs[from].name.clone()),
        returns: Some(planes.each_ref().map(Vec::len)),
    }
}

fn subset_count(planes: &[Vec<usize>; 3]) -> usize {
    planes.iter().map(Vec::len).sum()
}
