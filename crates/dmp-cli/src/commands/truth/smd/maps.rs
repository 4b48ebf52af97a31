//! The maps that are measured: given, or fused from a log.

use std::path::Path;

use anyhow::Context as _;
use dmp::{Config, MapSource, fuse_maps};
use dmp_log::{
    LogError, has_bag_name, is_mesh, open_log, read_cloud, read_mesh, read_trajectory, shown_path,
};
use dmp_sensor::{Isometry3, Trajectory};
use dmp_truth::surface::{
    EvaluatedPoints, MapError, Store, SurfaceError, SurfaceReport, SurfaceSettings, surfel_centres,
};
use dmp_truth::trajectory::rigid_alignment;

use crate::console::{Common, Progress, Usage};
use crate::files::is_missing;
use crate::inputs::{LogHead, LogInput, RunClock, Runs, announce, extrinsic, to_score};
use crate::options::{Asked, truth};

/// Every map against the reference.
#[derive(Debug)]
pub(super) struct Measured {
    pub(super) reference_format: &'static str,
    pub(super) maps: Vec<MeasuredMap>,
    /// Whether part of the log was lost.
    pub(super) damaged: bool,
}

/// One map against the reference.
#[derive(Debug)]
pub(super) struct MeasuredMap {
    pub(super) name: String,
    pub(super) format: &'static str,
    pub(super) reference_from_map: Isometry3<f64>,
    pub(super) report: SurfaceReport,
}

struct Bench<'a> {
    reference: &'a Path,
    mesh: bool,
    format: &'static str,
    settings: &'a SurfaceSettings,
    progress: &'a Progress,
}

pub(super) fn measure(
    asked: &Asked,
    config: &Config,
    settings: &SurfaceSettings,
    progress: &Progress,
    common: &Common,
) -> anyhow::Result<Measured> {
    let reference = &asked.need(&truth::SURFACE)?;
    let mut bench = Bench { reference, mesh: is_mesh(reference)?, format: "", settings, progress };
    let map = asked.need(&truth::MEASURED)?;
    if is_missing(&map) {
        return Err(LogError::NotFound { path: map }.into());
    }
    let (maps, damaged) = if Runs::files(asked).is_empty() {
        (vec![bench.measure_file(&map, &asked.all(&truth::ALIGN_MAP))?], false)
    } else {
        bench.measure_runs(&map, asked, config, common)?
    };
    Ok(Measured { reference_format: bench.format, maps, damaged })
}

impl Bench<'_> {
    /// A cloud or a store, moved as its trajectory is.
    fn measure_file(&mut self, path: &Path, align: &[std::path::PathBuf]) -> anyhow::Result<MeasuredMap> {
        if path.is_dir() || has_bag_name(path) {
            let text = format!("{}: a log has no map: give a run with -t RUN.tum", path.display());
            return Err(Usage(text).into());
        }
        let reference_from_map = match align {
            [] => Isometry3::identity(),
            [reference, estimate] => {
                align_files(&read_trajectory(reference)?.trajectory, reference, estimate)?
            }
            _ => return Err(Usage("--align needs REFERENCE.tum and the map's ESTIMATE.tum".into()).into()),
        };
        let mut points = EvaluatedPoints::new(self.settings, reference_from_map)?;
        self.progress.start("reading the map", "points", 0);
        let format = match Store::open(path) {
            Ok(store) => {
                self.add_store(&store, &mut points)?;
                "surfels"
            }
            Err(MapError::NotAStore { .. }) => {
                let summary = read_cloud(path, None, |batch| -> anyhow::Result<()> {
                    self.progress.read(batch.len())?;
                    Ok(points.add(batch)?)
                })?;
                summary.format.name()
            }
            Err(error) => return Err(error.into()),
        };
        let name = shown_path(path);
        let report = self.measure_points(points, &name)?;
        Ok(MeasuredMap { name, format, reference_from_map, report })
    }

    /// The maps of runs, fused from the log.
    fn measure_runs(
        &mut self,
        log: &Path,
        asked: &Asked,
        config: &Config,
        common: &Common,
    ) -> anyhow::Result<(Vec<MeasuredMap>, bool)> {
        let reference = match asked.all(&truth::ALIGN_MAP).as_slice() {
            [] => None,
            [reference] => Some((read_trajectory(reference)?.trajectory, reference.clone())),
            _ => {
                return Err(
                    Usage("--align needs only REFERENCE.tum: the runs are given with -t".into()).into()
                );
            }
        };
        let started = Runs::start(asked)?;
        let log = open_log(log, &LogInput::at(log.to_owned(), asked).options)?;
        let loaded = started.finish(log.summary())?;
        let mut moves = Vec::new();
        for run in &loaded {
            moves.push(match &reference {
                None => Isometry3::identity(),
                Some((trajectory, path)) => align(trajectory, path, &run.trajectory, &run.path)?,
            });
        }
        let extrinsics = extrinsic::of_runs(asked, &loaded, &[], LogHead::of_log(log.as_ref()))?;
        if !common.quiet {
            announce::extrinsics(&common.host, &loaded, &extrinsics);
        }
        let damaged = loaded.iter().any(|run| run.damaged) || !log.summary().damage.is_empty();
        let runs = {
            let clocks = std::iter::repeat(RunClock::default());
            to_score(loaded, std::iter::repeat(MapSource::Fused), extrinsics, clocks)
        };
        let maps = fuse_maps(log.as_ref(), &runs, config, self.progress)?;
        let mut measured = Vec::new();
        for ((name, store), reference_from_map) in maps.iter().zip(moves) {
            let mut points = EvaluatedPoints::new(self.settings, reference_from_map)?;
            self.progress.start("reading the map", "points", 0);
            self.add_store(store, &mut points)?;
            let report = self.measure_points(points, name)?;
            measured.push(MeasuredMap {
                name: name.to_owned(),
                format: "surfels",
                reference_from_map,
                report,
            });
        }
        Ok((measured, damaged))
    }

    fn add_store(&self, store: &Store, points: &mut EvaluatedPoints) -> Result<(), SurfaceError> {
        surfel_centres(store, |centres| {
            self.progress.read(centres.len())?;
            points.add(centres)
        })
    }

    fn measure_points(&mut self, points: EvaluatedPoints, name: &str) -> anyhow::Result<SurfaceReport> {
        let mut reference = points.against_reference().with_context(|| name.to_owned())?;
        self.progress.start("reading the reference", "", 0);
        self.format = if self.mesh {
            let summary = read_mesh(self.reference, |batch| -> anyhow::Result<()> {
                self.progress.read(batch.len())?;
                Ok(reference.add_triangles(batch)?)
            });
            summary?.format.name()
        } else {
            let summary = read_cloud(self.reference, None, |batch| -> anyhow::Result<()> {
                self.progress.read(batch.len())?;
                Ok(reference.add_points(batch)?)
            });
            summary?.format.name()
        };
        let context = || format!("{name} against {}", self.reference.display());
        reference.measure(self.progress).with_context(context)
    }
}

fn align_files(reference: &Trajectory, path: &Path, estimate: &Path) -> anyhow::Result<Isometry3<f64>> {
    align(reference, path, &read_trajectory(estimate)?.trajectory, estimate)
}

fn align(
    reference: &Trajectory,
    reference_path: &Path,
    estimate: &Trajectory,
    estimate_path: &Path,
) -> anyhow::Result<Isometry3<f64>> {
    let context = || format!("{} onto {}", estimate_path.display(), reference_path.display());
    rigid_alignment(reference, estimate).with_context(context)
}
