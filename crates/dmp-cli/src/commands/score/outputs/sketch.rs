//! What the page of `--report` and the scene of `--scene` show of single returns: gathered while they are scored, drawn when
//! all are.

use std::collections::HashMap;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use dmp::{Basis, FrameSums, MapSource, Report, Run, Scales, ScoredReturns, ScoredRun, Settings};
use dmp_draw::{FrameScore, Pictures, SampledReturn, SeenFrame};
use dmp_log::ScanLog;
use dmp_map::Store;
use dmp_sensor::Isometry3;

use super::gathered::Gathered;
use super::pictures;
use super::residuals::{Buffers, drawn};
use super::scene::{self, Scene};
use super::spool::Spool;
use crate::console::Hosted;

/// Returns that are drawn, about: what a page can show.
const RETURNS: u64 = 1_000_000;

/// Gathers what is drawn.
#[derive(Debug)]
pub(super) struct Sketch {
    host: Hosted,
    wanted: Wanted,
    bases: Vec<Basis>,
    scales: Scales,
    /// One return of so many is drawn.
    every: u64,
    frames: Mutex<HashMap<u32, Seen>>,
    spool: Mutex<Option<Spool>>,
    drawn: Mutex<Drawn>,
}

/// What is to be drawn.
#[derive(Debug, Clone)]
pub(super) struct Wanted {
    pub(super) page: bool,
    pub(super) scene: Option<PathBuf>,
}

/// What became of drawing, once it was tried; `None` where it was not.
#[derive(Debug, Default)]
pub(super) struct Drawn {
    pub(super) pictures: Option<anyhow::Result<Pictures>>,
    pub(super) scene: Option<anyhow::Result<Scene>>,
}

/// What is known of a scan so far.
#[derive(Debug, Default)]
struct Seen {
    poses: Vec<Isometry3<f64>>,
    scores: Vec<FrameScore>,
}

impl Sketch {
    /// Of an evaluation of these runs. What is drawn waits in the folder.
    pub(super) fn new(
        log: &dyn ScanLog,
        runs: &[Run],
        settings: &Settings,
        (folder, host): (&Path, &Hosted),
        wanted: Wanted,
    ) -> io::Result<Self> {
        // As pairs are judged: by what is known of both maps.
        let all_fused = runs.iter().all(|run| run.map == MapSource::Fused);
        let basis = if all_fused { Basis::CrossValidated } else { Basis::Near };
        let returns = log.frames().iter().map(|frame| frame.returns).sum::<u64>() / settings.every as u64;
        let scans = log.frames().len() / settings.every;
        let expected = returns / settings.returns.draw((returns, scans), 0).one_in() as u64;
        Ok(Self {
            host: host.clone(),
            wanted,
            bases: vec![basis; runs.len()],
            scales: settings.scales,
            every: expected.div_ceil(RETURNS).max(1),
            frames: Mutex::default(),
            spool: Mutex::new(Some(Spool::new(folder)?)),
            drawn: Mutex::default(),
        })
    }

    /// Bytes that wait in the folder, of so many returns that are scored.
    pub(super) fn work_bytes(&self, returns: u64) -> u64 {
        returns / self.every * (self.bases.len() * SampledReturn::BYTES) as u64
    }

    /// Keeps those returns of a part of a scan that are drawn.
    pub(super) fn returns_scored(
        &self,
        frame: u32,
        scored: &ScoredReturns<'_>,
        buffers: &Buffers,
    ) -> io::Result<()> {
        // Drawn is what all runs have.
        let Some(runs) = scored.runs.iter().map(Option::as_ref).collect::<Option<Vec<_>>>() else {
            return Ok(());
        };
        if scored.first == 0 {
            let poses = runs.iter().map(|run| run.own_from_sensor).collect();
            lock(&self.frames).entry(frame).or_default().poses = poses;
        }
        let position = |run: &&ScoredRun<'_>| run.own_from_sensor.translation.vector.into();
        let positions: Vec<[f64; 3]> = runs.iter().map(position).collect();
        buffers.with(|piece| {
            piece.extend_from_slice(&frame.to_le_bytes());
            let first = scored.first as u64;
            for number in drawn(frame, self.every, first..first + scored.offsets_ns.len() as u64) {
                let index = (number - first) as usize;
                if !runs.iter().all(|run| run.is_posed[index]) {
                    continue;
                }
                for (run, basis) in self.bases.iter().enumerate() {
                    let (ray, residuals) = (runs[run].own_ray(index), &runs[run].residuals[index]);
                    let residual_m = match basis {
                        Basis::CrossValidated => residuals.independent_m,
                        // Where nothing is near, what is far is as wrong as can be.
                        Basis::Near => residuals.nearest_m.or(residuals.first_m),
                    };
                    let endpoint = ray.endpoint_in_world();
                    let sampled = SampledReturn {
                        from_sensor_m: std::array::from_fn(|axis| {
                            (endpoint[axis] - positions[run][axis]) as f32
                        }),
                        direction: ray.direction_in_world.map(|along| along as f32),
                        residual_m: residual_m.filter(|m| m.is_finite()).map(|m| m as f32),
                        revisited: residuals.revisited,
                    };
                    piece.extend_from_slice(&sampled.to_bytes());
                }
            }
            match &*lock(&self.spool) {
                Some(spool) => spool.add(frame, piece),
                None => Ok(()),
            }
        })
    }

    /// Keeps what a scan was scored.
    pub(super) fn frame_scored(&self, frame: u32, sums: &FrameSums) {
        let runs = sums.runs();
        let scores =
            runs.iter().zip(&self.bases).map(|(sums, basis)| FrameScore::of(sums, *basis, self.scales));
        lock(&self.frames).entry(frame).or_default().scores = scores.collect();
    }

    /// Draws everything, while the maps are there. An error is reported when it is to be written: scores are not lost for it.
    pub(super) fn scored(&self, log: &dyn ScanLog, report: &Report, maps: &[&Store]) {
        let Some(spool) = lock(&self.spool).take() else { return };
        let (frames, poses) = self.frames_in_time(log);
        let index_of_run = |name: &String| report.runs.iter().position(|run| run.name == *name);
        let gathered = Gathered {
            frames,
            poses,
            scales: self.scales,
            bases: self.bases.clone(),
            order: report.order.iter().filter_map(index_of_run).collect(),
            start_ns: log.summary().span_ns.map(|(first_ns, _)| first_ns),
            kept: spool.sorted(),
        };
        let scene = self.wanted.scene.as_ref();
        let scene = scene.map(|path| scene::draw(path, &gathered, (report, maps), &self.host));
        let pictures = self.wanted.page.then(|| pictures::draw(gathered, maps, &self.host));
        *lock(&self.drawn) = Drawn { pictures, scene };
    }

    /// Scans with a used return, in the order of their time, as they are scored: a log may hold them in another. And their
    /// poses in every run.
    fn frames_in_time(&self, log: &dyn ScanLog) -> (Vec<SeenFrame>, Vec<Vec<Isometry3<f64>>>) {
        let stamps: HashMap<u32, Option<i64>> = log
            .frames()
            .iter()
            .enumerate()
            .map(|(index, frame)| (log.number_in_log(index) as u32, frame.stamp_ns))
            .collect();
        let seen = std::mem::take(&mut *lock(&self.frames));
        // A scan without a used return has no place.
        let seen = seen.into_iter().filter(|(_, seen)| seen.poses.len() == seen.scores.len());
        let mut frames: Vec<(SeenFrame, Vec<Isometry3<f64>>)> = seen
            .map(|(number, Seen { poses, scores })| {
                let position = |pose: &Isometry3<f64>| pose.translation.vector.into();
                let frame = SeenFrame {
                    number: number as usize,
                    stamp_ns: stamps.get(&number).copied().flatten(),
                    position_in_world_m: poses.iter().map(position).collect(),
                    scores,
                };
                (frame, poses)
            })
            .collect();
        frames.sort_by_key(|(frame, _)| (frame.stamp_ns, frame.number));
        frames.into_iter().unzip()
    }

    /// What was drawn.
    pub(super) fn into_drawn(self) -> Drawn {
        self.drawn.into_inner().unwrap_or_else(PoisonError::into_inner)
    }
}

fn lock<T>(of: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    of.lock().unwrap_or_else(PoisonError::into_inner)
}
