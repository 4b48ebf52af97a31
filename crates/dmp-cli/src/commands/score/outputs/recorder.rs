//! What is gathered while an evaluation runs, and written behind it.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

use anyhow::{Context as _, bail};
use dmp::{EvaluateError, FrameSums, Means, Note, Report, Run, ScoredReturns, Settings, Sink, Stage};
use dmp_draw::text;
use dmp_log::{ResidualFormat, ScanLog, ScoredPoint};
use dmp_map::Store;

use super::args::Outputs;
use super::keep::Keep;
use super::residuals::{Buffers, Origin, RunReturns};
use super::rows::RunRows;
use super::scene::Scene;
use super::sketch::{Drawn, Sketch, Wanted};
use super::spool::Spool;
use super::{page, per_frame, per_tile, residuals};
use crate::console::{Common, Hosted, Progress, Usage, say};

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

    /// The evaluation is over: its report, unless what was to be written could not be kept.
    pub(crate) fn end(self, evaluated: Result<Report, EvaluateError>) -> anyhow::Result<(Report, Recorded)> {
        if let Some(error) = self.failure.into_inner().unwrap_or_else(PoisonError::into_inner) {
            return Err(error).with_context(|| waits_in(self.work_folder));
        }
        let recorded = Recorded {
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
        self.has_failed.load(Ordering::Relaxed) || dmp::Progress::cancelled(&self.progress)
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

impl Recorded {
    /// Writes all files, each whole or not at all, until somebody asks to stop. What is written is reported, unless
    /// `quiet`. `remarks` are sentences for the page.
    pub(crate) fn write(self, report: &Report, remarks: &[String], quiet: bool) -> anyhow::Result<()> {
        let report_file = |path: &Path, what: String| {
            if !quiet {
                self.progress.suspend(|| say!(self.host, "{}: {what}", path.display()));
            }
        };
        if let Some(path) = self.per_tile {
            self.host.go_on()?;
            per_tile::write(&path, report, &self.rows)?;
            report_file(&path, text::counted(report.tiles.len() as u64, "row"));
        }
        if let Some(Page { path, reference }) = self.page {
            self.host.go_on()?;
            let drawn = self.drawn.pictures.transpose();
            let pictures = drawn.with_context(|| format!("{}: cannot draw", path.display()))?;
            let bytes = page::write(&path, report, pictures.as_ref(), reference.as_deref(), remarks)?;
            report_file(&path, text::bytes(bytes));
        }
        if let (Some(path), Some(scene)) = (self.scene, self.drawn.scene) {
            self.host.go_on()?;
            report_file(&path, scene.and_then(Scene::finish)?);
        }
        if let Some((path, lines)) = self.per_frame {
            self.host.go_on()?;
            per_frame::write(&path, report.config.scales, &lines.sorted())?;
            report_file(&path, text::counted(report.sampling.frames_scored * self.rows.len() as u64, "row"));
        }
        if let Some(keep) = self.keep {
            self.progress.scans("writing", report.sampling.frames_scored);
            let path = keep.path().to_path_buf();
            let step = || self.progress.one_scan();
            let bytes = keep.write(report, (&|| self.host.go_on(), &step))?;
            report_file(&path, text::bytes(bytes));
        }
        if self.residuals.is_empty() {
            return Ok(());
        }
        self.progress.scans("writing", report.sampling.frames_scored * self.residuals.len() as u64);
        let step = || self.progress.one_scan();
        let go_on = || self.host.go_on();
        let (threads, start_ns) = (self.threads.min(self.residuals.len()), self.start_ns);
        let left = Mutex::new(self.residuals.into_iter());
        let work = || -> anyhow::Result<()> {
            loop {
                let next = left.lock().unwrap_or_else(PoisonError::into_inner).next();
                let Some(returns) = next else { return Ok(()) };
                self.host.go_on()?;
                let (path, name) = (returns.file.path.clone(), returns.name.clone());
                let points = residuals::write(returns, start_ns, (&go_on, &step))?;
                report_file(&path, format!("{} of {name}", text::counted(points, "return")));
            }
        };
        std::thread::scope(|scope| {
            let threads: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
            let resume = |panic| std::panic::resume_unwind(panic);
            threads.into_iter().try_for_each(|thread| thread.join().unwrap_or_else(resume))
        })
    }
}
