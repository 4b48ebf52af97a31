//! What is gathered while an evaluation runs, and written behind it.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

use anyhow::{Context as _, bail};
use dmp::{EvaluateError, FrameSums, Means, Note, Report, Run, ScoredReturns, Settings, Sink, Stage};
use dmp_draw::text;
use dmp_log::{CloudFormat, LAS_REACH_M, ResidualFormat, ScanLog, ScoredPoint};
use dmp_map::Store;

use super::args::Outputs;
use super::keep::Keep;
use super::residuals::{Buffers, Origin, RunReturns};
use super::rows::RunRows;
use super::scene::Scene;
use super::sketch::{Drawn, Sketch, Wanted};
use super::spool::Spool;
use super::{page, per_frame, per_tile, residuals};
use crate::console::{Common, Hosted, Progress, Usage, is_interrupt, say};

/// Follows an evaluation: shows its progress and keeps what is to be written.
#[derive(Debug)]
pub(crate) struct Recorder<'a> {
    progress: Progress,
    host: Hosted,
    log: &'a dyn ScanLog,
    work_folder: &'a Path,
    threads: usize,
    residuals: Vec<RunReturns>,
    buffers: Buffers,
    per_frame: Option<(PathBuf, Spool)>,
    per_tile: Option<PathBuf>,
    sketch: Option<Sketch>,
    page: Option<Page>,
    scene: Option<PathBuf>,
    keep: Option<Keep>,
    rows: Vec<RunRows>,
    has_failed: AtomicBool,
    failure: Mutex<Option<std::io::Error>>,
}

impl<'a> Recorder<'a> {
    /// What is asked of an evaluation of these runs. What cannot be written of this log is an error here.
    pub(crate) fn new(
        outputs: Outputs,
        log: &'a dyn ScanLog,
        runs: &[Run],
        (settings, means): (&Settings, &'a Means),
        common: &Common,
    ) -> anyhow::Result<Self> {
        let work_folder = means.work_folder.as_path();
        let spool = || Spool::new(work_folder).with_context(|| waits_in(work_folder));
        let mut residuals = Vec::new();
        for (run, file) in outputs.residuals.into_iter().enumerate() {
            let Some(file) = file else { continue };
            if file.format == ResidualFormat::Mcap && log.summary().span_ns.is_none() {
                let path = file.path.display();
                bail!(Usage(format!(
                    "{path}: the log has no stamps, which MCAP needs; try .laz, .ply or .pcd"
                )));
            }
            if let ResidualFormat::Cloud(CloudFormat::Las | CloudFormat::Laz) = file.format {
                in_reach_of_las(&file.path, &runs[run], log, settings)?;
            }
            let name = runs[run].name.clone();
            let is_fused = runs[run].map == dmp::MapSource::Fused;
            let scales = settings.scales;
            residuals.push(RunReturns { run, name, file, is_fused, scales, spool: spool()? });
        }
        let per_frame = match outputs.per_frame {
            Some(path) => Some((path, spool()?)),
            None => None,
        };
        if let Some(path) = outputs.scene.as_ref().filter(|_| log.summary().span_ns.is_none()) {
            let path = path.display();
            bail!(Usage(format!(
                "{path}: the log has no stamps, which MCAP needs; --report draws it as a page"
            )));
        }
        let keep = match outputs.keep {
            Some(path) => Some(Keep::new(path, runs, settings.scales, spool()?)?),
            None => None,
        };
        let reference = outputs.reference;
        let page = outputs.page.map(|path| Page { path, reference });
        let wanted = Wanted { page: page.is_some(), scene: outputs.scene.clone() };
        let sketch = if page.is_some() || outputs.scene.is_some() {
            let sketch = Sketch::new(log, runs, settings, (work_folder, &common.host), wanted);
            Some(sketch.with_context(|| waits_in(work_folder))?)
        } else {
            None
        };
        Ok(Self {
            progress: Progress::new(common),
            host: common.host.clone(),
            log,
            work_folder,
            threads: means.threads,
            residuals,
            buffers: Buffers::default(),
            per_frame,
            per_tile: outputs.per_tile,
            sketch,
            page,
            scene: outputs.scene,
            keep,
            rows: runs.iter().map(|run| RunRows::new(run, settings.miss_price)).collect(),
            has_failed: AtomicBool::new(false),
            failure: Mutex::new(None),
        })
    }

    fn record(&self, result: std::io::Result<()>) {
        if let Err(error) = result {
            self.failure.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
            self.has_failed.store(true, Ordering::Relaxed);
        }
    }

    /// The evaluation is over: its report, and what is to be written, as far as it could be kept.
    pub(crate) fn end(self, evaluated: Result<Report, EvaluateError>) -> anyhow::Result<(Report, Recorded)> {
        let failure = self.failure.into_inner().unwrap_or_else(PoisonError::into_inner);
        let failure = failure.map(|error| anyhow::Error::new(error).context(waits_in(self.work_folder)));
        let recorded = Recorded {
            failure,
            progress: self.progress,
            host: self.host,
            start_ns: self.log.summary().span_ns.map(|(first_ns, _)| first_ns),
            threads: self.threads,
            residuals: self.residuals,
            per_frame: self.per_frame,
            per_tile: self.per_tile,
            drawn: self.sketch.map(Sketch::into_drawn).unwrap_or_default(),
            page: self.page,
            scene: self.scene,
            keep: self.keep,
            rows: self.rows,
        };
        Ok((evaluated?, recorded))
    }
}

/// Refuses LAS for a run of which a pose during the log lies further from the first than LAS can say.
fn in_reach_of_las(path: &Path, run: &Run, log: &dyn ScanLog, settings: &Settings) -> Result<(), Usage> {
    let (poses, span_ns) = (run.trajectory.poses(), log.summary().span_ns.zip(run.trajectory.stamps_ns()));
    let shift_ns = settings.time_offset_ns(run);
    let is_scanned = |k: &usize| {
        span_ns.is_none_or(|((first_ns, last_ns), stamps_ns)| {
            let log_ns = stamps_ns[*k].saturating_sub(shift_ns);
            (first_ns..=last_ns).contains(&log_ns)
        })
    };
    let mut scanned = (0..poses.len()).filter(is_scanned);
    let Some(first) = scanned.next() else { return Ok(()) };
    let reach_m = LAS_REACH_M - 2.0 * settings.max_range_m;
    let is_far =
        |&k: &usize| (poses[k].translation.vector - poses[first].translation.vector).amax() > reach_m;
    let Some(far) = scanned.find(is_far) else { return Ok(()) };
    let [place, from] = [far, first].map(|k| poses[k].translation.vector);
    Err(Usage(format!(
        "{}: LAS reaches {:.0} km from the first point, and run {} has a pose at ({:.1}, {:.1}, {:.1}) m (pose {} of {}), far from \
         ({:.1}, {:.1}, {:.1}) m: correct that pose, or write .ply, .pcd or .mcap",
        path.display(),
        (LAS_REACH_M / 1e3).floor(),
        run.name,
        place.x,
        place.y,
        place.z,
        far + 1,
        poses.len(),
        from.x,
        from.y,
        from.z,
    )))
}

fn waits_in(folder: &Path) -> String {
    format!("{}: cannot keep what is to be written; --work names another folder", folder.display())
}

impl dmp::Progress for Recorder<'_> {
    fn begin(&self, stage: Stage, total: u64) {
        self.progress.begin(stage, total);
    }

    fn advance(&self, amount: u64) {
        dmp::Progress::advance(&self.progress, amount);
    }

    fn note(&self, note: &Note) {
        self.progress.note(note);
    }

    fn cancelled(&self) -> bool {
        dmp::Progress::cancelled(&self.progress)
    }
}

impl Sink for Recorder<'_> {
    fn returns_scored(&self, returns: &ScoredReturns<'_>) {
        if self.has_failed.load(Ordering::Relaxed) {
            return;
        }
        let frame = returns.frame as u32;
        if let Some(sketch) = &self.sketch {
            self.record(sketch.returns_scored(frame, returns, &self.buffers));
        }
        let stamp_ns = self.log.frames().get(returns.frame).and_then(|frame| frame.stamp_ns).unwrap_or(0);
        if let Some(keep) = &self.keep {
            self.record(keep.keep(returns, stamp_ns, &self.buffers));
        }
        let start_ns = self.log.summary().span_ns.map_or(0, |(first_ns, _)| first_ns);
        let origin = Origin { frame, start_ns, stamp_ns };
        for run in &self.residuals {
            self.record(run.keep(returns, origin, &self.buffers));
        }
    }

    fn frame_scored(&self, frame: usize, sums: &FrameSums) {
        if let Some(sketch) = &self.sketch {
            sketch.frame_scored(frame as u32, sums);
        }
        let Some((_, spool)) = &self.per_frame else { return };
        let stamp_ns = self.log.frames().get(frame).and_then(|frame| frame.stamp_ns);
        let frame = frame as u32;
        let lines = per_frame::lines(frame, stamp_ns, sums, &self.rows);
        self.record(spool.add(frame, lines.as_bytes()));
    }

    fn scored(&self, report: &Report, maps: &[&Store]) {
        if let Some(sketch) = &self.sketch {
            sketch.scored(self.log, report, maps);
        }
    }

    fn work_bytes(&self, returns: u64) -> u64 {
        let of_run = returns * ScoredPoint::BYTES as u64;
        let of_sketch = self.sketch.as_ref().map_or(0, |sketch| sketch.work_bytes(returns));
        let of_keep = self.keep.as_ref().map_or(0, |keep| keep.work_bytes(returns));
        self.residuals.len() as u64 * of_run + of_sketch + of_keep
    }

    fn wants_every_return(&self) -> bool {
        let of_returns = !self.residuals.is_empty() || self.keep.is_some();
        of_returns || self.per_frame.is_some() || self.sketch.is_some()
    }
}

/// A page to be written.
#[derive(Debug)]
struct Page {
    path: PathBuf,
    reference: Option<String>,
}

/// What was gathered.
pub(crate) struct Recorded {
    /// Why some of it could not be kept.
    failure: Option<anyhow::Error>,
    progress: Progress,
    host: Hosted,
    start_ns: Option<i64>,
    threads: usize,
    residuals: Vec<RunReturns>,
    per_frame: Option<(PathBuf, Spool)>,
    per_tile: Option<PathBuf>,
    drawn: Drawn,
    page: Option<Page>,
    scene: Option<PathBuf>,
    keep: Option<Keep>,
    rows: Vec<RunRows>,
}

/// A file that is written, by what is printed of it.
type Writing<'a> = Box<dyn FnOnce() -> anyhow::Result<(PathBuf, String)> + 'a>;

impl Recorded {
    /// Writes all files, each whole or not at all, until somebody asks to stop. What is written is reported, unless
    /// `quiet`; why a file is not, in what is returned: the others are written all the same. `remarks` are sentences for the
    /// page.
    ///
    /// # Errors
    /// When somebody asks to stop.
    pub(crate) fn write(
        self,
        report: &Report,
        remarks: &[String],
        quiet: bool,
    ) -> anyhow::Result<Vec<anyhow::Error>> {
        let Self { failure, progress, host, start_ns, threads, residuals, rows, .. } = self;
        let is_kept = failure.is_none();
        let failures = Mutex::new(Vec::from_iter(failure));
        let done = |written: anyhow::Result<(PathBuf, String)>| match written {
            Ok((path, what)) if !quiet => {
                progress.suspend(|| say!(host, "{}: {what}", path.display()));
                Ok(())
            }
            Ok(_) => Ok(()),
            Err(error) if is_interrupt(&error) => Err(error),
            Err(error) => {
                failures.lock().unwrap_or_else(PoisonError::into_inner).push(error);
                Ok(())
            }
        };
        let (step, go_on) = (|| progress.one_scan(), || host.go_on());
        let frames = report.sampling.frames_scored;
        let mut files: Vec<Writing<'_>> = Vec::new();
        if let Some(path) = self.per_tile {
            files.push(Box::new(|| {
                per_tile::write(&path, report, &rows)?;
                Ok((path, text::counted(report.tiles.len() as u64, "row")))
            }));
        }
        // What could not be kept is in no file.
        if let Some(Page { path, reference }) = self.page.filter(|_| is_kept) {
            let drawn = self.drawn.pictures.transpose();
            files.push(Box::new(move || {
                let pictures = drawn.with_context(|| format!("{}: cannot draw", path.display()))?;
                let bytes = page::write(&path, report, pictures.as_ref(), reference.as_deref(), remarks)?;
                Ok((path, text::bytes(bytes)))
            }));
        }
        if let (Some(path), Some(scene)) = (self.scene.filter(|_| is_kept), self.drawn.scene) {
            files.push(Box::new(move || Ok((path, scene.and_then(Scene::finish)?))));
        }
        if let Some((path, lines)) = self.per_frame.filter(|_| is_kept) {
            files.push(Box::new(|| {
                per_frame::write(&path, report.config.scales, &lines.sorted())?;
                Ok((path, text::counted(frames * rows.len() as u64, "row")))
            }));
        }
        if let Some(keep) = self.keep.filter(|_| is_kept) {
            files.push(Box::new(|| {
                progress.scans("writing", frames);
                let path = keep.path().to_path_buf();
                let bytes = keep.write(report, (&go_on, &step))?;
                Ok((path, text::bytes(bytes)))
            }));
        }
        for file in files {
            host.go_on()?;
            done(file())?;
        }
        if is_kept && !residuals.is_empty() {
            progress.scans("writing", frames * residuals.len() as u64);
            let threads = threads.min(residuals.len());
            let left = Mutex::new(residuals.into_iter());
            let work = || -> anyhow::Result<()> {
                loop {
                    let next = left.lock().unwrap_or_else(PoisonError::into_inner).next();
                    let Some(returns) = next else { return Ok(()) };
                    host.go_on()?;
                    let (path, name) = (returns.file.path.clone(), returns.name.clone());
                    let points = residuals::write(returns, start_ns, (&go_on, &step));
                    done(
                        points.map(|points| (path, format!("{} of {name}", text::counted(points, "return")))),
                    )?;
                }
            };
            std::thread::scope(|scope| {
                let threads: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
                let resume = |panic| std::panic::resume_unwind(panic);
                threads.into_iter().try_for_each(|thread| thread.join().unwrap_or_else(resume))
            })?;
        }
        Ok(failures.into_inner().unwrap_or_else(PoisonError::into_inner))
    }
}
