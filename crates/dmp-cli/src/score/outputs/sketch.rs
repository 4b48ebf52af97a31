//! What the page of `--report` shows of single returns: gathered while they are scored, drawn when all are.

use std::collections::HashMap;
use std::io;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

use dmp::{Basis, FrameSums, MapSource, Report, Run, Sample, Scales, ScoredReturns, ScoredRun, Settings};
use dmp_draw::{DiscInWorld, FrameScore, Painter, Pictures, SampledReturn, SeenFrame};
use dmp_log::ScanLog;
use dmp_map::{OwnDisc, Store, TileId};

use super::residuals::{Buffers, drawn};
use super::spool::Spool;
use crate::host::Hosted;

/// Returns that are drawn, about: what a page can show.
const RETURNS: u64 = 1_000_000;
/// Of a sample that grows until it decides, if it grows to all scans: with fewer scans there are to be some to see.
const DECIDING_RETURNS: u64 = 4_000_000;

/// Gathers what is drawn.
#[derive(Debug)]
pub(super) struct Sketch {
    host: Hosted,
    bases: Vec<Basis>,
    scales: Scales,
    /// One return of so many is drawn.
    every: u64,
    frames: Mutex<HashMap<u32, Seen>>,
    spool: Mutex<Option<Spool>>,
    /// What became of drawing, once it was tried.
    pictures: Mutex<Option<anyhow::Result<Pictures>>>,
}

/// What is known of a scan so far.
#[derive(Debug, Default)]
struct Seen {
    position_in_world_m: Vec<[f64; 3]>,
    scores: Vec<FrameScore>,
}

impl Sketch {
    /// Of an evaluation of these runs. What is drawn waits in the folder.
    pub(super) fn new(
        log: &dyn ScanLog,
        runs: &[Run],
        settings: &Settings,
        (folder, host): (&Path, &Hosted),
    ) -> io::Result<Self> {
        // As pairs are judged: by what is known of both maps.
        let all_fused = runs.iter().all(|run| run.map == MapSource::Fused);
        let basis = if all_fused { Basis::CrossValidated } else { Basis::Near };
        let (scans, returns) =
            log.frames().iter().fold((0_u64, 0), |(n, sum), frame| (n + 1, sum + frame.returns));
        let (scans, returns) = (scans as f64 / settings.every as f64, returns as f64 / settings.every as f64);
        let (scored, drawn) = match (&settings.sample, &settings.decide) {
            (_, Some(_)) => (scans, DECIDING_RETURNS),
            (Sample::Frames(frames), None) => (*frames as f64, RETURNS),
            (Sample::Share(share), None) => (share * scans, RETURNS),
            (Sample::All, None) => (scans, RETURNS),
        };
        let expected = returns * (scored / scans.max(1.0)).min(1.0);
        Ok(Self {
            host: host.clone(),
            bases: vec![basis; runs.len()],
            scales: settings.scales,
            every: ((expected / drawn as f64).ceil() as u64).max(1),
            frames: Mutex::default(),
            spool: Mutex::new(Some(Spool::new(folder)?)),
            pictures: Mutex::default(),
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
        let position = |run: &ScoredRun<'_>| run.own_from_sensor.translation.vector.into();
        let positions = || scored.runs.iter().map(position).collect();
        if scored.first == 0 {
            lock(&self.frames).entry(frame).or_default().position_in_world_m = positions();
        }
        let positions: Vec<[f64; 3]> = positions();
        buffers.with(|piece| {
            piece.extend_from_slice(&frame.to_le_bytes());
            let first = scored.first as u64;
            for number in drawn(frame, self.every, first..first + scored.offsets_ns.len() as u64) {
                let index = (number - first) as usize;
                for (run, basis) in self.bases.iter().enumerate() {
                    let (ray, residuals) =
                        (scored.runs[run].own_ray(index), &scored.runs[run].residuals[index]);
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

    /// Draws everything, while the maps are there. What goes wrong is told with the pictures: scores are not lost for it.
    pub(super) fn scored(&self, log: &dyn ScanLog, report: &Report, maps: &[&Store]) {
        let drawn = self.draw(log, report, maps);
        *lock(&self.pictures) = drawn.transpose();
    }

    fn draw(&self, log: &dyn ScanLog, report: &Report, maps: &[&Store]) -> anyhow::Result<Option<Pictures>> {
        let frames = self.frames_in_time(log);
        let index_of: HashMap<usize, usize> =
            frames.iter().enumerate().map(|(index, frame)| (frame.number, index)).collect();
        let index_of_run = |name: &String| report.runs.iter().position(|run| run.name == *name);
        let order = report.order.iter().filter_map(index_of_run).collect();
        let Some(spool) = lock(&self.spool).take() else { return Ok(None) };
        let kept = spool.sorted();
        let of_return = self.bases.len() * SampledReturn::BYTES;
        let returns = kept.pieces().map(|bytes| (bytes / of_return) as u64).sum();
        let start_ns = log.summary().span_ns.map(|(first_ns, _)| first_ns);
        let mut painter = Painter::new(self.scales, frames, start_ns, self.bases.clone(), order, returns);
        for (run, window, extent_m) in painter.windows() {
            draw_discs(&mut painter, maps[run], run, window, extent_m)?;
        }
        for run in painter.clouds() {
            self.host.go_on()?;
            draw_map(&mut painter, maps[run], run)?;
        }
        let mut of_runs = Vec::new();
        kept.each(|piece, _| {
            self.host.go_on()?;
            let (frame, returns) = piece.split_at(size_of::<u32>().min(piece.len()));
            let number = frame.try_into().map(u32::from_le_bytes);
            let Some(&index) = number.ok().and_then(|number| index_of.get(&(number as usize))) else {
                return Ok(());
            };
            for sampled in returns.chunks_exact(of_return) {
                of_runs.clear();
                of_runs.extend(sampled.as_chunks().0.iter().map(SampledReturn::of_bytes));
                painter.sampled(index, &of_runs);
            }
            Ok(())
        })?;
        Ok(Some(painter.finish()))
    }

    /// Scans with a used return, in the order of their time, as they are scored: a log may hold them in another.
    fn frames_in_time(&self, log: &dyn ScanLog) -> Vec<SeenFrame> {
        let stamps: HashMap<u32, Option<i64>> = log
            .frames()
            .iter()
            .enumerate()
            .map(|(index, frame)| (log.number_in_log(index) as u32, frame.stamp_ns))
            .collect();
        let seen = std::mem::take(&mut *lock(&self.frames));
        // A scan without a used return has no place.
        let seen = seen.into_iter().filter(|(_, seen)| seen.position_in_world_m.len() == seen.scores.len());
        let mut frames: Vec<SeenFrame> = seen
            .map(|(number, seen)| SeenFrame {
                number: number as usize,
                stamp_ns: stamps.get(&number).copied().flatten(),
                position_in_world_m: seen.position_in_world_m,
                scores: seen.scores,
            })
            .collect();
        frames.sort_by_key(|frame| (frame.stamp_ns, frame.number));
        frames
    }

    /// What was drawn; `None` where nothing was scored.
    pub(super) fn into_pictures(self) -> anyhow::Result<Option<Pictures>> {
        self.pictures.into_inner().unwrap_or_else(PoisonError::into_inner).transpose()
    }
}

/// Draws the surfels of all tiles that a window touches.
fn draw_discs(
    painter: &mut Painter,
    map: &Store,
    run: usize,
    window: usize,
    [low_m, high_m]: [[f64; 2]; 2],
) -> anyhow::Result<()> {
    let radius_m = map.lattice().disc_radius_m();
    let mut tiles: Vec<TileId> = map
        .entries()
        .filter(|entry| {
            let [low, high] = map.box_in_own_m(entry);
            (0..2).all(|axis| low[axis] <= high_m[axis] && high[axis] >= low_m[axis])
        })
        .map(|entry| entry.tile)
        .collect();
    tiles.sort_unstable();
    for tile in tiles {
        for OwnDisc { centre_in_own_m, normal_in_own } in map.discs_in_own(tile)? {
            let disc = DiscInWorld { centre_in_world_m: centre_in_own_m, normal: normal_in_own, radius_m };
            painter.disc(run, window, &disc);
        }
    }
    Ok(())
}

/// Draws a sample of the surfels of a whole map.
fn draw_map(painter: &mut Painter, map: &Store, run: usize) -> anyhow::Result<()> {
    let (radius_m, of_all) = (map.lattice().disc_radius_m(), map.surfels());
    let mut tiles: Vec<TileId> = map.entries().map(|entry| entry.tile).collect();
    tiles.sort_unstable();
    let mut number = 0;
    for tile in tiles {
        for OwnDisc { centre_in_own_m, normal_in_own } in map.discs_in_own(tile)? {
            let disc = DiscInWorld { centre_in_world_m: centre_in_own_m, normal: normal_in_own, radius_m };
            painter.surfel(run, (number, of_all), &disc);
            number += 1;
        }
    }
    Ok(())
}

fn lock<T>(of: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    of.lock().unwrap_or_else(PoisonError::into_inner)
}
