//! The work folder of an evaluation and its checkpoints.

use std::hash::Hasher as _;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use dmp_disk::{DiskError, WorkFolder};
use dmp_log::ScanLog;
use dmp_runs::{EvaluateError, MapSource, Means, Note, Progress, Run, Settings, pool};
use dmp_sensor::seven;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::means::extent::Extent;
use crate::means::memory::Budget;

/// The resources of an evaluation: its threads, its share of the memory, its folder and its checkpoints.
#[derive(Debug)]
pub(crate) struct Work {
    folder: WorkFolder,
    every: Option<Duration>,
    last: Mutex<Instant>,
    budget: Budget,
    pool: rayon::ThreadPool,
    resumed: bool,
}

/// A checkpoint has a type and a file name for every stage.
pub(crate) trait Checkpoint: Serialize + DeserializeOwned {
    const NAME: &'static str;
}

impl Work {
    /// Opens a folder for this evaluation inside that of the settings, with its checkpoint if it is resumed.
    pub(crate) fn open(
        log: &dyn ScanLog,
        runs: &[Run],
        settings: &Settings,
        means: &Means,
        extent: Extent,
    ) -> Result<Self, EvaluateError> {
        let budget = Budget::new(log, extent, means)?;
        // Before the folder, which is removed if anything after it fails.
        let pool = pool(means.threads)?;
        let parent = &means.work_folder;
        let folder = if means.checkpoint_every.is_none() && !means.resume {
            WorkFolder::new(parent)?
        } else {
            match WorkFolder::of(parent, &identity(log, runs, settings, means)?, means.resume) {
                // The same evaluation runs at the same time: each gets a folder of its own.
                Err(DiskError::Locked { .. }) if !means.resume => WorkFolder::new(parent)?,
                folder => folder?,
            }
        };
        let resumed = folder.has_checkpoint();
        let (every, last) = (means.checkpoint_every, Mutex::new(Instant::now()));
        Ok(Self { folder, every, last, budget, pool, resumed })
    }

    /// Whether there is a checkpoint to resume from.
    pub(crate) fn is_resumed(&self) -> bool {
        self.resumed
    }

    pub(crate) fn pool(&self) -> &rayon::ThreadPool {
        &self.pool
    }

    /// Runs `what` on its threads.
    pub(crate) fn install<R: Send>(&self, what: impl FnOnce() -> R + Send) -> R {
        self.pool.install(what)
    }

    /// The division of the memory.
    pub(crate) fn budget(&self) -> &Budget {
        &self.budget
    }

    pub(crate) fn path(&self) -> &Path {
        self.folder.path()
    }

    pub(crate) fn file(&self, name: &str) -> PathBuf {
        self.folder.file(name)
    }

    /// Time between checkpoints; `None` without checkpoints.
    pub(crate) fn every(&self) -> Option<Duration> {
        self.every
    }

    /// Whether a checkpoint is due.
    pub(crate) fn due(&self) -> bool {
        let last = *self.last.lock().unwrap_or_else(PoisonError::into_inner);
        self.every.is_some_and(|every| last.elapsed() >= every)
    }

    pub(crate) fn save<C: Checkpoint>(&self, state: &C) -> Result<(), EvaluateError> {
        let bytes = postcard::to_allocvec(state).map_err(EvaluateError::Checkpoint)?;
        self.folder.save(C::NAME, &bytes)?;
        *self.last.lock().unwrap_or_else(PoisonError::into_inner) = Instant::now();
        Ok(())
    }

    pub(crate) fn load<C: Checkpoint>(&self) -> Result<Option<C>, EvaluateError> {
        let Some(bytes) = self.folder.load(C::NAME)? else {
            return Ok(None);
        };
        postcard::from_bytes(&bytes).map(Some).map_err(EvaluateError::Checkpoint)
    }

    /// Whether there is a checkpoint.
    pub(crate) fn holds<C: Checkpoint>(&self) -> bool {
        self.folder.holds(C::NAME)
    }

    /// Syncs a file to disk before a checkpoint refers to it.
    pub(crate) fn sync(&self, file: &Path) -> Result<(), EvaluateError> {
        Ok(self.folder.sync(file)?)
    }

    /// Removes the folder's files whose names end in `.extension`.
    pub(crate) fn remove_files(&self, extension: &str) {
        self.folder.remove_files(extension);
    }

    pub(crate) fn forget<C: Checkpoint>(&self) {
        self.folder.forget(C::NAME);
    }

    /// Leaves the folder for another process if there is a checkpoint, and notifies the watcher of its path.
    pub(crate) fn leave(mut self, progress: &dyn Progress) {
        if self.folder.has_checkpoint() {
            self.folder.keep();
            progress.note(&Note::WorkKept { folder: self.folder.path().to_path_buf() });
        }
    }
}

/// Identifies everything that the numbers depend on, and where maps are saved: this version, the log, the
/// runs, the settings. The same on every machine and in every build.
fn identity(
    log: &dyn ScanLog,
    runs: &[Run],
    settings: &Settings,
    means: &Means,
) -> Result<String, EvaluateError> {
    let summary = log.summary();
    let of_log = (&summary.fingerprint, &summary.topic, &summary.point_times, log.frames().len() as u64);
    let mut hash = Hash(fnv::FnvHasher::default());
    hash.add(&(env!("CARGO_PKG_VERSION"), of_log, settings))?;
    hash.add(&means.save_maps.as_ref().map(|folder| folder.as_os_str().as_encoded_bytes()))?;
    for frame in log.frames() {
        hash.add(&(frame.stamp_ns, frame.returns))?;
    }
    for run in runs {
        hash.add(&(&run.name, run.trajectory.stamps_ns(), seven(&settings.body_from_sensor(run))))?;
        hash.add(&(run.instant(), run.time_offset_ns))?;
        for pose in run.trajectory.poses() {
            hash.add(&seven(pose))?;
        }
        if let MapSource::Given(path) = &run.map {
            let changed = std::fs::metadata(path).and_then(|data| Ok((data.len(), data.modified()?)));
            hash.add(&(path.as_os_str().as_encoded_bytes(), changed.ok()))?;
        }
    }
    Ok(format!("{:016x}", hash.0.finish()))
}

/// The 64-bit FNV-1a hash of a serialised value.
struct Hash(fnv::FnvHasher);

impl Hash {
    fn add(&mut self, what: &impl Serialize) -> Result<(), EvaluateError> {
        let bytes = postcard::to_allocvec(what).map_err(EvaluateError::Checkpoint)?;
        self.0.write(&bytes);
        Ok(())
    }
}
