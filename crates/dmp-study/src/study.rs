//! The study of one log: every score of every run, beside ground truth and the metrics of others.

use dmp::{Config, EvaluateError, Report, Run, Watch, evaluate};
use dmp_log::ScanLog;
use dmp_sensor::Trajectory;
use serde::Serialize;

use crate::clouds::CloudWatch;
use crate::columns::{lower, of_report};
use crate::error::StudyError;
use crate::maps::{distances_of, go_on, mom_of};
use crate::options::StudyOptions;
use crate::peers::{MapSharpness, map_sharpness};
use crate::table::{Correlation, StudyTable};
use crate::truth::{ReferenceSurface, TrajectoryErrors, trajectory_errors};

/// The scores of a log's runs beside ground truth and other metrics. Serialised, it is the command's JSON:
/// schema `dmp-study/1`, described in `docs/study.md`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Study {
    /// Always `dmp-study/1`.
    pub schema: &'static str,
    /// Version of this program.
    pub dmp_version: &'static str,
    /// Every quantity of every run.
    #[serde(flatten)]
    pub table: StudyTable,
    /// Every pair of columns.
    pub correlations: Vec<Correlation>,
    /// How runs were compared with the reference trajectory.
    pub truth: TruthReport,
    /// How they were compared with the reference surface; null without one.
    pub surface: Option<SurfaceReport>,
    /// How the metrics of others were taken; null where they were left out.
    pub peers: Option<PeerReport>,
    /// What a reader should know.
    pub notes: Vec<String>,
    /// The whole report of the scores: schema `dmp-score/2`.
    pub score: Report,
}

/// How runs were compared with the reference trajectory.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TruthReport {
    /// Poses of the reference.
    pub reference_poses: usize,
    /// Largest difference of stamps, seconds.
    pub max_diff_s: f64,
    /// Way between the poses of a relative error, metres.
    pub rpe_delta_m: f64,
    /// Poses with a partner, for each run.
    pub matched_poses: Vec<usize>,
}

/// How runs were compared with the reference surface.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SurfaceReport {
    /// A distance beyond this counted as this, metres.
    pub cap_m: f64,
    /// Points of each run.
    pub points: usize,
}

/// How the metrics of others were taken.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PeerReport {
    /// Points closer than this are neighbours, metres.
    pub radius_m: f64,
    /// More neighbours than this are needed, the point itself included.
    pub min_neighbours: usize,
    /// Points of each run.
    pub points: usize,
    /// Those with enough neighbours, for each run.
    pub used: Vec<usize>,
    /// Scans in which MOM's planes were looked for.
    pub mom_scans: usize,
    /// The run in whose scans they were found; null where no run has any.
    pub mom_planes_from: Option<String>,
    /// Returns on each of the three directions.
    pub mom_returns: Option<[usize; 3]>,
}

/// Scores `runs` on `log` and compares each with `reference`, and with `surface` where there is one.
///
/// `reference` moves the same body as the runs do. The numbers do not depend on threads, memory or the order
/// of reading, as those of [`evaluate`] do not.
///
/// # Errors
/// When a run and the reference have no poses in common, a setting makes no sense, the runs cannot be scored,
/// or the surface cannot be read. What is quick to find out is found out first.
pub fn study<'a>(
    log: &'a dyn ScanLog,
    runs: &'a [Run],
    reference: &Trajectory,
    surface: Option<&ReferenceSurface<'_>>,
    config: &Config,
    options: &StudyOptions,
    watch: impl Into<Watch<'a>>,
) -> Result<Study, StudyError> {
    check(options)?;
    let watch = watch.into();
    let progress = watch.progress;
    let against_reference = |run: &Run| {
        let errors = trajectory_errors(reference, &run.trajectory, &options.truth);
        errors.map_err(|source| StudyError::Reference { run: run.name.clone(), source })
    };
    let errors: Vec<TrajectoryErrors> = runs.iter().map(against_reference).collect::<Result<_, _>>()?;

    let wants_points = surface.is_some() || options.peers.is_some();
    let max_points = if wants_points { options.max_points } else { 0 };
    let mom_returns = if options.peers.is_some() { options.mom_returns } else { 0 };
    let collecting = CloudWatch::new(watch, max_points, mom_returns);
    let score = evaluate(log, runs, config, (&collecting, &collecting))?;
    let clouds = collecting.finish();

    let mut notes = Vec::new();
    let mut columns = of_report(&score);
    columns.push(lower("ate_rmse_m", "ATE", "m", errors.iter().map(|e| Some(e.ate_rmse_m)).collect()));
    for (run, errors) in runs.iter().zip(&errors) {
        if let Err(why) = &errors.rpe_rmse_m {
            notes.push(format!("run `{}` has no RPE: {why}", run.name));
        }
    }
    let steps = errors.iter().map(|e| e.rpe_rmse_m.as_ref().ok().copied());
    columns.push(lower("rpe_rmse_m", "RPE", "m", steps.collect()));

    if let Some(surface) = surface {
        let distances = distances_of(runs, &errors, &clouds, surface, config, options, progress)?;
        columns.push(lower("smd_mean_m", "SMD", "m", distances.iter().map(|d| Some(d.0)).collect()));
        columns.push(lower("smd_median_m", "SMD median", "m", distances.iter().map(|d| Some(d.1)).collect()));
    }
    let points = clouds.clouds.first().map_or(0, Vec::len);
    let mut peer_report = None;
    if let Some(peers) = &options.peers {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(config.threads).build();
        let pool = pool.map_err(|source| EvaluateError::Threads { threads: config.threads, source })?;
        let sharpness_of = |cloud: &Vec<[f64; 3]>| {
            go_on(progress)?;
            Ok(map_sharpness(cloud, peers))
        };
        let sharpness: Vec<MapSharpness> =
            pool.install(|| clouds.clouds.iter().map(sharpness_of).collect::<Result<_, EvaluateError>>())?;
        go_on(progress)?;
        let mom = pool.install(|| mom_of(runs, &clouds, peers, &mut notes));
        columns.push(lower("mme", "MME", "nats", sharpness.iter().map(|s| s.mme).collect()));
        columns.push(lower("mpv_m2", "MPV", "m²", sharpness.iter().map(|s| s.mpv_m2).collect()));
        columns.push(lower("mom_m2", "MOM", "m²", mom.values));
        peer_report = Some(PeerReport {
            radius_m: peers.radius_m,
            min_neighbours: peers.min_neighbours,
            points,
            used: sharpness.iter().map(|s| s.used).collect(),
            mom_scans: clouds.first_scan_count,
            mom_planes_from: mom.planes_from,
            mom_returns: mom.returns,
        });
    }
    let table = StudyTable { runs: runs.iter().map(|run| run.name.clone()).collect(), columns };
    Ok(Study {
        schema: "dmp-study/1",
        dmp_version: env!("CARGO_PKG_VERSION"),
        correlations: table.correlations(),
        table,
        truth: TruthReport {
            reference_poses: reference.len(),
            max_diff_s: options.truth.max_diff_s,
            rpe_delta_m: options.truth.rpe_delta_m,
            matched_poses: errors.iter().map(|e| e.poses).collect(),
        },
        surface: surface.map(|_| SurfaceReport { cap_m: options.surface_cap_m, points }),
        peers: peer_report,
        notes,
        score,
    })
}

fn check(options: &StudyOptions) -> Result<(), StudyError> {
    let lengths = [
        ("largest difference of stamps, s,", options.truth.max_diff_s, 0.0..=1e6),
        ("way of a relative error, m,", options.truth.rpe_delta_m, 1e-3..=1e6),
        ("radius of the neighbours, m,", options.peers.unwrap_or_default().radius_m, 0.01..=10.0),
        ("cap of the surface distance, m,", options.surface_cap_m, 0.001..=100.0),
    ];
    for (setting, value, range) in lengths {
        if !range.contains(&value) {
            let why = "it is out of its range";
            return Err(StudyError::Setting { setting, value, why });
        }
    }
    Ok(())
}
