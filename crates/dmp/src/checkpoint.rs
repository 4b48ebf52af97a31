use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use dmp_disk::{DiskError, WorkFolder};
use dmp_log::ScanLog;
use dmp_reduce::{RunSums, Seen};
use dmp_sensor::{Isometry3, ReturnCounts};
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::config::{Config, MapSource, Run};
use crate::error::EvaluateError;
use crate::frames::FrameSet;
use crate::memory::Budget;
use crate::plan::Plan;
use crate::room::Room;
use crate::trails::TrailSummary;
use crate::watch::Watch;

/// What an evaluation works with: its share of the memory, its folder, and what it keeps there to be taken up again.
#[derive(Debug)]
pub(crate) struct Work {
    folder: WorkFolder,
    every: Option<Duration>,
    last: Mutex<Instant>,
    budget: Budget,
    resumed: bool,
}

/// Which time the maps are fused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Round {
    /// From all returns.
    First,
    /// Without those on trails.
    WithoutTrails,
}

/// Maps as far as they are fused.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub(crate) struct Fusing {
    pub(crate) done: FrameSet,
    pub(crate) counts: ReturnCounts,
    pub(crate) left_out: u64,
    /// As [`dmp_map::MapFuser::put_down`] gives it, for every run whose map is fused.
    pub(crate) fusers: Vec<Option<Vec<u8>>>,
}

/// Finished maps.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub(crate) struct Fused {
    pub(crate) counts: Option<ReturnCounts>,
    pub(crate) left_out: u64,
    pub(crate) scratch_bytes: u64,
    pub(crate) trails: Option<TrailSummary>,
    pub(crate) maps: Vec<FusedMap>,
}

/// The finished map of one run; no path where it was given as a store.
#[derive(Debug, serde::Serialize, serde::Deserialize)]
pub(crate) struct FusedMap {
    pub(crate) path: Option<PathBuf>,
    pub(crate) fused: bool,
    pub(crate) thin_voxels: Option<u64>,
    pub(crate) points_dropped: u64,
    pub(crate) notes: Vec<String>,
}

/// Scores as far as rays are cast.
#[derive(Debug, serde::Serialize, serde::Deserialize)]
pub(crate) struct Casting {
    pub(crate) done: FrameSet,
    pub(crate) reducer: Seen,
    pub(crate) counts: ReturnCounts,
    /// Run, column and row of a tile, and its sums.
    pub(crate) tiles: Vec<(u64, i32, i32, RunSums)>,
}

/// A checkpoint has a name of its own for every stage, and a type.
pub(crate) trait Checkpoint: Serialize + DeserializeOwned {
    const NAME: &'static str;
}

impl Checkpoint for Fusing {
    const NAME: &'static str = "fusing";
}

impl Checkpoint for Fused {
    const NAME: &'static str = "fused";
}

impl Checkpoint for Casting {
    const NAME: &'static str = "casting";
}

impl Work {
    /// A folder for this evaluation inside the one of the settings: as it was left, where it is to be resumed.
    pub(crate) fn open(log: &dyn ScanLog, runs: &[Run], config: &Config) -> Result<Self, EvaluateError> {
        let budget = Budget::new(log, runs, config)?;
        let parent = &config.work_folder;
        let folder = if config.checkpoint_every.is_none() && !config.resume {
            WorkFolder::new(parent)
        } else {
            match WorkFolder::of(parent, &identity(log, runs, config), config.resume) {
                // Somebody evaluates the same at the same time: each in a folder of its own.
                Err(DiskError::Locked { .. }) if !config.resume => WorkFolder::new(parent),
                folder => folder,
            }
        };
        let folder = folder.map_err(EvaluateError::work)?;
        let resumed = folder.has_checkpoint();
        Ok(Self { folder, every: config.checkpoint_every, last: Mutex::new(Instant::now()), budget, resumed })
    }

    /// Does something in the folder. Where that fails, what was done stays for another process, and `watch` is told
    /// where.
    pub(crate) fn within<T>(
        self,
        watch: &dyn Watch,
        what: impl FnOnce(&Self) -> Result<T, EvaluateError>,
    ) -> Result<(T, Self), EvaluateError> {
        if self.resumed {
            watch.note(&format!("goes on from what was done in {}", self.path().display()));
        }
        match what(&self) {
            Ok(done) => Ok((done, self)),
            Err(error) => {
                if let Some(folder) = self.leave() {
                    let folder = folder.display();
                    watch.note(&format!(
                        "what was done so far is kept in {folder}: the same command with --resume goes on"
                    ));
                }
                Err(error)
            }
        }
    }

    /// Estimates what will be written and whether there is room for it; where there may be none, `watch` is told. What
    /// is gone on with has its place already.
    pub(crate) fn look_for_room(
        &self,
        log: &dyn ScanLog,
        plan: &Plan<'_>,
        runs: &[Run],
        config: &Config,
        watch: &dyn Watch,
    ) -> Result<(Room, Option<String>), EvaluateError> {
        let room = Room::estimate(log, plan, runs, config, &self.budget)?;
        let warning = if self.resumed { None } else { room.check(config)? };
        warning.iter().for_each(|warning| watch.note(warning));
        Ok((room, warning))
    }

    /// How the memory is shared out.
    pub(crate) fn budget(&self) -> &Budget {
        &self.budget
    }

    pub(crate) fn path(&self) -> &Path {
        self.folder.path()
    }

    pub(crate) fn file(&self, name: &str) -> PathBuf {
        self.folder.file(name)
    }

    /// Time from one checkpoint to the next; `None` where there are none.
    pub(crate) fn every(&self) -> Option<Duration> {
        self.every
    }

    /// Whether it is time for a checkpoint.
    pub(crate) fn due(&self) -> bool {
        let last = *self.last.lock().unwrap_or_else(PoisonError::into_inner);
        self.every.is_some_and(|every| last.elapsed() >= every)
    }

    pub(crate) fn save<C: Checkpoint>(&self, round: Round, state: &C) -> Result<(), EvaluateError> {
        let bytes = postcard::to_allocvec(state).map_err(EvaluateError::Checkpoint)?;
        self.folder.save(&name::<C>(round), &bytes).map_err(EvaluateError::work)?;
        *self.last.lock().unwrap_or_else(PoisonError::into_inner) = Instant::now();
        Ok(())
    }

    pub(crate) fn load<C: Checkpoint>(&self, round: Round) -> Result<Option<C>, EvaluateError> {
        let Some(bytes) = self.folder.load(&name::<C>(round)).map_err(EvaluateError::work)? else {
            return Ok(None);
        };
        postcard::from_bytes(&bytes).map(Some).map_err(EvaluateError::Checkpoint)
    }

    /// Whether there is one.
    pub(crate) fn holds<C: Checkpoint>(&self, round: Round) -> bool {
        self.folder.holds(&name::<C>(round))
    }

    /// Brings a file to disk that a checkpoint will speak of.
    pub(crate) fn sync(&self, file: &Path) -> Result<(), EvaluateError> {
        self.folder.sync(file).map_err(EvaluateError::work)
    }

    /// Removes the folder's files whose names end in `.extension`.
    pub(crate) fn remove_files(&self, extension: &str) {
        self.folder.remove_files(extension);
    }

    pub(crate) fn forget<C: Checkpoint>(&self, round: Round) {
        self.folder.forget(&name::<C>(round));
    }

    /// Leaves what was done for another process, where there is a checkpoint; tells where.
    fn leave(mut self) -> Option<PathBuf> {
        self.folder.has_checkpoint().then(|| {
            self.folder.keep();
            self.folder.path().to_path_buf()
        })
    }
}

fn name<C: Checkpoint>(round: Round) -> String {
    match round {
        Round::First => C::NAME.to_owned(),
        Round::WithoutTrails => format!("{}-without-trails", C::NAME),
    }
}

/// Stands for everything that the numbers depend on: this version, the log, the runs, the settings.
fn identity(log: &dyn ScanLog, runs: &[Run], config: &Config) -> String {
    let mut hasher = DefaultHasher::new();
    env!("CARGO_PKG_VERSION").hash(&mut hasher);
    let summary = log.summary();
    (&summary.fingerprint, &summary.topic, &summary.point_times, log.frames().len()).hash(&mut hasher);
    for frame in log.frames() {
        (frame.stamp_ns, frame.returns).hash(&mut hasher);
    }
    for run in runs {
        run.name.hash(&mut hasher);
        run.trajectory.stamps_ns().hash(&mut hasher);
        run.trajectory.poses().iter().for_each(|pose| hash_pose(pose, &mut hasher));
        hash_pose(&run.body_from_sensor(config), &mut hasher);
        if let MapSource::Given(path) = &run.map {
            let changed = std::fs::metadata(path).and_then(|data| Ok((data.len(), data.modified()?)));
            (path, changed.ok()).hash(&mut hasher);
        }
    }
    // Where and with what it is done changes no number.
    let numbers = Config {
        body_from_sensor: Isometry3::identity(),
        memory_bytes: 0,
        threads: 0,
        work_folder: PathBuf::new(),
        checkpoint_every: None,
        resume: false,
        ..config.clone()
    };
    format!("{numbers:?}").hash(&mut hasher);
    format!("{:016x}", hasher.finish())
}

fn hash_pose(pose: &Isometry3<f64>, hasher: &mut impl Hasher) {
    let numbers = pose.translation.vector.iter().chain(pose.rotation.coords.iter());
    numbers.for_each(|number| number.to_bits().hash(hasher));
}
