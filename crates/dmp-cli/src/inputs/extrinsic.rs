//! Where the sensor sits on the body that a trajectory moves: `--extrinsic`.

use std::fmt;
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use dmp::LeftOutReport;
use dmp_log::{Calib, LogSummary, find_calib, read_calib, shown_path};
use dmp_sensor::Isometry3;

use super::loaded_run::LoadedRun;
use super::log_input::LogHead;
use crate::console::Usage;
use crate::named::{Named, assign};
use crate::options::extrinsic::Extrinsic;
use crate::options::{Asked, input};

/// How much of a body's movement must go along an axis for the axis to be its direction: 37 degrees.
const ALONG: f64 = 0.8;

/// Most frames that are named: a log may have a hundred thousand.
const MOST_NAMED: usize = 8;

/// The extrinsic that takes effect.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct BodyFromSensor {
    pub(crate) transform: Isometry3<f64>,
    /// Where it is from, in words.
    pub(crate) source: String,
}

impl BodyFromSensor {
    fn identity(why: impl fmt::Display) -> Self {
        Self { transform: Isometry3::identity(), source: format!("identity: {why}") }
    }
}

/// Each run's extrinsic: the one given for it by name, else the one given for all, else found by looking. Of those unread only the
/// names are known.
pub(crate) fn of_runs(
    asked: &Asked,
    runs: &[LoadedRun],
    unread: &[LeftOutReport],
    log: LogHead<'_>,
) -> anyhow::Result<Vec<BodyFromSensor>> {
    let given = asked.all(&input::EXTRINSIC);
    let unread = unread.iter().map(|run| run.name.as_str());
    let names: Vec<&str> = runs.iter().map(|run| run.name.as_str()).chain(unread).collect();
    let of_runs = assign("--extrinsic", &names, given.iter().map(Named::parts))?;
    runs.iter()
        .zip(of_runs)
        .map(|(run, extrinsic)| of_run(extrinsic.unwrap_or(&Extrinsic::Auto), run, log))
        .collect()
}

fn of_run(extrinsic: &Extrinsic, run: &LoadedRun, log: LogHead<'_>) -> anyhow::Result<BodyFromSensor> {
    match extrinsic {
        Extrinsic::Auto => auto(run, log),
        Extrinsic::Identity => Ok(BodyFromSensor::identity("as given")),
        Extrinsic::Given(transform) => Ok(BodyFromSensor { transform: *transform, source: "given".into() }),
        Extrinsic::Calib(file) => {
            let calib = match file {
                Some(path) => Calib { path: path.clone(), camera_from_velodyne: read_calib(path)? },
                None => calib_beside(run, log.summary)?.ok_or_else(|| no_calib(run, log.summary))?,
            };
            Ok(of_calib(&calib, "as asked for"))
        }
        Extrinsic::Frame(name) => of_frame(name, run, log),
    }
}

/// What frames, files and movement say.
fn auto(run: &LoadedRun, log: LogHead<'_>) -> anyhow::Result<BodyFromSensor> {
    if let Some(body) = &run.body_frame {
        return of_frame(body, run, log);
    }
    if let Some(calib) = calib_beside(run, log.summary)? {
        return of_camera_or_lidar(run, &calib);
    }
    let sensor = log.summary.frame_id.as_deref().unwrap_or_default();
    if !log.static_frames.beside(sensor).is_empty() {
        return Err(Usage(which_frame(run, log)).into());
    }
    Ok(BodyFromSensor::identity("neither a calib.txt nor frames say otherwise"))
}

/// The scans' frame on the body's, by the static frames of the log or of the run's own bag.
fn of_frame(body: &str, run: &LoadedRun, log: LogHead<'_>) -> anyhow::Result<BodyFromSensor> {
    let path = log.summary.path.display();
    let Some(sensor) = log.summary.frame_id.as_deref().filter(|frame| !frame.is_empty()) else {
        let problem = format!(
            "run `{}`: the trajectory moves `{body}`, but the scans of {path} name no frame: give --extrinsic",
            run.name
        );
        return Err(Usage(problem).into());
    };
    if body.trim_start_matches('/') == sensor.trim_start_matches('/') {
        return Ok(BodyFromSensor::identity(format!("the trajectory moves the scans' frame `{sensor}`")));
    }
    let found = [log.static_frames, &run.static_frames].into_iter().find_map(|f| f.a_from_b(body, sensor));
    if let Some(transform) = found {
        return Ok(BodyFromSensor { transform, source: format!("/tf_static: `{sensor}` on `{body}`") });
    }
    let mut known = log.static_frames.beside(sensor);
    known.extend(run.static_frames.beside(sensor));
    known.sort_unstable();
    known.dedup();
    let known = match known.as_slice() {
        [] => "no frame that it hangs on".to_owned(),
        known => a_few(known, ", "),
    };
    let problem = format!(
        "run `{}`: /tf_static does not say where the scans' frame `{sensor}` is on the body's `{body}` (it knows {known}): \
         give --extrinsic X,Y,Z,QX,QY,QZ,QW, or identity where they are the same",
        run.name
    );
    Err(Usage(problem).into())
}

/// A trajectory that does not say which frame it moves, in a log with frames: the choices.
fn which_frame(run: &LoadedRun, log: LogHead<'_>) -> String {
    let sensor = log.summary.frame_id.as_deref().unwrap_or_default();
    let beside = log.static_frames.beside(sensor);
    let choices: Vec<String> = beside.iter().map(|frame| format!("--extrinsic frame:{frame}")).collect();
    format!(
        "run `{}`: {} does not say which frame it moves, and {} has several: give --extrinsic identity (the scans' own \
         `{sensor}`) or {}",
        run.name,
        run.given,
        log.summary.path.display(),
        a_few(&choices, " or ")
    )
}

/// The first of many names, and how many there are more.
fn a_few(names: &[impl AsRef<str>], between: &str) -> String {
    let shown: Vec<&str> = names.iter().take(MOST_NAMED).map(AsRef::as_ref).collect();
    let more = names.len() - shown.len();
    let rest = if more > 0 { format!("{between}one of {more} more") } else { String::new() };
    shown.join(between) + &rest
}

/// KITTI's own poses move the camera while the scans are the LiDAR's, and what others make of its logs moves
/// either: the direction of travel in the body's axes decides.
fn of_camera_or_lidar(run: &LoadedRun, calib: &Calib) -> anyhow::Result<BodyFromSensor> {
    let path = shown_path(&calib.path);
    match run.trajectory.travel_in_body() {
        Some(travel) if travel.z > ALONG => {
            Ok(of_calib(calib, "the body travels along its z, as a camera does"))
        }
        Some(travel) if travel.x.abs() > ALONG => Ok(BodyFromSensor::identity(format!(
            "the body travels along its x, not as a camera does: {path} not used"
        ))),
        travel => {
            let moves = travel.map_or("does not travel in one direction".to_owned(), |travel| {
                let [x, y, z] = travel.into();
                format!("travels along ({x:.2}, {y:.2}, {z:.2})")
            });
            Err(Usage(format!(
                "run `{}`: its body {moves}, so it is neither clearly KITTI's camera (z ahead) nor its LiDAR (x ahead): \
                 say with --extrinsic calib that {path} is to be used, or with --extrinsic identity that it is not",
                run.name
            ))
            .into())
        }
    }
}

fn of_calib(calib: &Calib, why: &str) -> BodyFromSensor {
    let source = format!("{}: {why}", shown_path(&calib.path));
    BodyFromSensor { transform: calib.camera_from_velodyne, source }
}

/// KITTI's calibration beside the trajectory, in the log's folder or in that one's parent.
fn calib_beside(run: &LoadedRun, log: &LogSummary) -> anyhow::Result<Option<Calib>> {
    let folders = calib_folders(run, log).with_context(|| log.path.display().to_string())?;
    Ok(find_calib(folders.iter().map(PathBuf::as_path))?)
}

fn calib_folders(run: &LoadedRun, log: &LogSummary) -> std::io::Result<Vec<PathBuf>> {
    // The parent of `velodyne` is `.`, not nothing.
    let parent = |path: &Path| std::path::absolute(path).ok()?.parent().map(Path::to_owned);
    let is_folder = std::fs::metadata(&log.path)?.is_dir();
    let log_folder = if is_folder { Some(log.path.clone()) } else { parent(&log.path) };
    let above = log_folder.as_deref().and_then(parent);
    Ok([parent(&run.path), log_folder, above].into_iter().flatten().collect())
}

fn no_calib(run: &LoadedRun, log: &LogSummary) -> Usage {
    let folders = calib_folders(run, log).unwrap_or_default();
    let folders: Vec<String> = folders.iter().map(|folder| folder.display().to_string()).collect();
    Usage(format!("--extrinsic calib: no calib.txt with Tr in {}; try calib:FILE", folders.join(", ")))
}
