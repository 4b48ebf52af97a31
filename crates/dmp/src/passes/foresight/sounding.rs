//! Estimates the memory and disk use of all maps from some of the scans, before any map is fused.

use std::collections::{BTreeMap, HashMap, HashSet};

use dmp_map::{BRICK_EDGE, Lattice, TileId, fused_bytes};
use dmp_runs::{EvaluateError, MapSource, PlannedFrame, PosedRun, Poser, Progress, Stage, WorldPoint, posed};
use dmp_sensor::Scan;

use crate::passes::evaluation::Evaluation;
use crate::passes::frames::{Worker, each_frame_of};

/// One in this many scans is sampled, more of a short log.
const ONE_OF: usize = 16;
const LEAST_SCANS: usize = 64;
/// Approximate limit of voxels held over all runs. A quarter of the memory limits them, too: each takes so many bytes with the
/// tables that are made of it.
const MOST_SEEN: u64 = 1 << 18;
const SEEN_BYTES: u64 = 160;
// Measured on simulated drives: docs/performance.md.

/// The number of voxels grows by a constant with each doubling of the returns. A surfel needs as many more
/// returns than a voxel as come in this many doublings.
const DOUBLINGS_TO_SURFEL: f64 = 2.2;
/// The estimate of the maps from some scans.
#[derive(Debug)]
pub(crate) struct Sounding {
    /// For each run whose map is fused from the scans.
    pub(crate) runs: Vec<SoundedRun>,
}

/// The estimate of one run's map.
#[derive(Debug)]
pub(crate) struct SoundedRun {
    /// In order of time.
    seen: Vec<Seen>,
    /// Index of the last of its sampled scans.
    scans: u32,
    /// One in this many scans was sampled, and in as many bricks.
    one_of: f64,
    part: f64,
    tile_edge_voxels: i32,
    /// How the number of voxels grows with scans, and that of bricks.
    growth: [Growth; 2],
    /// Voxels of the whole map, and its surfels.
    pub(crate) voxels: f64,
    pub(crate) surfels: f64,
}

/// How the number of cells grows with the scans that see them: with the number of scans, to a power of 0 to
/// 1.
#[derive(Debug, Clone, Copy, Default)]
struct Growth {
    /// For two consecutive scans.
    of_two: f64,
    /// Over the whole run, for the scans between the sampled ones.
    of_all: f64,
}

/// A voxel with returns of a scan.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Seen {
    /// Index of the sampled scan.
    scan: u32,
    voxel: [i32; 3],
    returns: u32,
}

impl<M: Sync + Send> Evaluation<'_, M> {
    /// Samples some scans, evenly spread.
    ///
    /// # Errors
    /// When the log cannot be read.
    pub(crate) fn sound(&self) -> Result<Sounding, EvaluateError> {
        let is_fused = |run: &&PosedRun<'_, M>| run.run.map == MapSource::Fused;
        let fused = self.runs.iter().filter(is_fused).count();
        if fused == 0 {
            return Ok(Sounding { runs: Vec::new() });
        }
        let lattice = Lattice::new(self.plan.surveyed.voxel_m)?;
        let frames = self.plan.frames();
        let one_of = (frames.len() / LEAST_SCANS).clamp(1, ONE_OF);
        let looked_at = frames.iter().step_by(one_of);
        let scans = looked_at.clone().count();
        let returns: u64 = looked_at.map(|frame| frame.returns).sum();
        let most_seen = (self.means.memory_bytes as u64 / 4 / SEEN_BYTES).clamp(1, MOST_SEEN);
        let part = (returns * fused as u64).div_ceil(most_seen).max(1);
        self.progress.begin(Stage::Survey, scans as u64);
        let worker = |_| Sounder {
            poser: Poser::new(posed(&self.runs), &self.plan.filter),
            numbers: (0..self.runs.len()).filter(|&run| is_fused(&&self.runs[run])).collect(),
            per_m: 1.0 / lattice.voxel_m(),
            one_of,
            part,
            seen: vec![Vec::new(); fused],
            progress: self.progress,
        };
        let workers = (0..self.means.threads).map(worker).collect();
        let reading = self.plan.reading(self.log, &self.means, self.progress);
        let is_wanted = |ordinal: usize| ordinal.is_multiple_of(one_of) && self.uses(ordinal);
        let workers = each_frame_of(reading, is_wanted, workers)?;
        let mut runs = vec![Vec::new(); fused];
        for worker in workers {
            runs.iter_mut().zip(worker.seen).for_each(|(run, seen)| run.extend(seen));
        }
        let tile_edge_voxels = (lattice.tile_edge_m() / lattice.voxel_m()).round() as i32;
        let (one_of, part) = (one_of as f64, part as f64);
        let run = |mut seen: Vec<Seen>| {
            seen.sort_unstable();
            SoundedRun::new(seen, scans as u32, [one_of, part], tile_edge_voxels)
        };
        Ok(Sounding { runs: runs.into_iter().map(run).collect() })
    }
}

/// Samples the scans of a thread.
struct Sounder<'e> {
    poser: Poser<'e, WorldPoint>,
    /// The numbers of the sampled runs.
    numbers: Vec<usize>,
    per_m: f64,
    one_of: usize,
    part: u64,
    seen: Vec<Vec<Seen>>,
    progress: &'e dyn Progress,
}

impl Worker for Sounder<'_> {
    fn frame(&mut self, ordinal: usize, frame: &PlannedFrame, scan: &Scan) -> Result<(), EvaluateError> {
        let Self { poser, numbers, per_m, one_of, part, seen, progress } = self;
        let first: Vec<usize> = seen.iter().map(Vec::len).collect();
        poser.blocks((ordinal, frame), scan, |block| {
            for (&number, seen) in numbers.iter().zip(&mut *seen) {
                for (_, end) in block.posed(number) {
                    let voxel = end.map(|c| (c * *per_m).floor() as i32);
                    if hash(brick_of(voxel)).is_multiple_of(*part) {
                        seen.push(Seen { scan: (ordinal / *one_of) as u32, voxel, returns: 1 });
                    }
                }
            }
            Ok::<(), EvaluateError>(())
        })?;
        for (seen, first) in seen.iter_mut().zip(first) {
            seen[first..].sort_unstable();
            let mut end = first;
            for k in first..seen.len() {
                if end > first && seen[end - 1].voxel == seen[k].voxel {
                    seen[end - 1].returns += 1;
                } else {
                    seen[end] = seen[k];
                    end += 1;
                }
            }
            seen.truncate(end);
        }
        progress.advance(1);
        Ok(())
    }
}

impl SoundedRun {
    fn new(seen: Vec<Seen>, scans: u32, [one_of, part]: [f64; 2], tile_edge_voxels: i32) -> Self {
        let growth = [Growth::default(); 2];
        let mut run = Self { seen, scans, one_of, part, tile_edge_voxels, growth, voxels: 0.0, surfels: 0.0 };
        let ([all, filled], [half, half_filled]) = (run.voxels_of(1), run.voxels_of(2));
        run.voxels = part * run.grown(all, half);
        let by_voxels = run.voxels - part * DOUBLINGS_TO_SURFEL * (all - half);
        run.surfels = by_voxels.max(part * run.grown(filled, half_filled)).min(run.voxels);
        run.growth = [run.growth_of(|voxel| voxel), run.growth_of(brick_of)];
        run
    }

    /// The number for all scans, from those of the sampled scans and of every second one.
    fn grown(&self, all: f64, half: f64) -> f64 {
        all + libm::log2(self.one_of) * (all - half)
    }

    /// Voxels of every n-th sampled scan, and those with enough returns for a surfel.
    fn voxels_of(&self, every: u32) -> [f64; 2] {
        let mut voxels: HashMap<[i32; 3], u32> = HashMap::new();
        for seen in self.seen.iter().filter(|seen| seen.scan.is_multiple_of(every)) {
            *voxels.entry(seen.voxel).or_default() += seen.returns;
        }
        [voxels.len() as f64, voxels.values().filter(|&&returns| returns >= FILLED).count() as f64]
    }

    /// How the number of cells, each known by one of its voxels, grows.
    fn growth_of(&self, place: impl Fn([i32; 3]) -> [i32; 3]) -> Growth {
        let scans: Vec<HashSet<[i32; 3]>> = self
            .seen
            .chunk_by(|a, b| a.scan == b.scan)
            .map(|scan| scan.iter().map(|seen| place(seen.voxel)).collect())
            .collect();
        let (mut one, mut both) = (0, 0);
        for pair in scans.windows(2) {
            one += pair[0].len() + pair[1].len();
            both += pair[0].union(&pair[1]).count();
        }
        let places = |every| {
            let looked_at = self.seen.iter().filter(|seen| seen.scan.is_multiple_of(every));
            looked_at.map(|seen| place(seen.voxel)).collect::<HashSet<_>>().len() as f64
        };
        let (all, half) = (places(1), places(2));
        let of_all = libm::log2(self.grown(all, half) / all) / libm::log2(self.one_of);
        Growth {
            of_two: if one > 0 { libm::log2(2.0 * both as f64 / one as f64) } else { 1.0 },
            of_all: if of_all.is_finite() { of_all } else { 0.0 },
        }
    }

    fn tile_of(&self, [x, y, _]: [i32; 3]) -> TileId {
        let [x, y] = [x, y].map(|c| c.div_euclid(self.tile_edge_voxels));
        TileId { x, y }
    }

    /// Approximate number of surfels of every tile.
    pub(crate) fn surfels_of_tiles(&self) -> HashMap<TileId, f64> {
        let voxels: HashSet<[i32; 3]> = self.seen.iter().map(|seen| seen.voxel).collect();
        let of_one = self.surfels / voxels.len().max(1) as f64;
        let mut tiles = HashMap::new();
        for voxel in voxels {
            *tiles.entry(self.tile_of(voxel)).or_default() += of_one;
        }
        tiles
    }

    /// Number of voxels spilled while the map is fused with this much memory, with `pauses` pauses in which
    /// all are spilled. It replays the sampled scans, each standing for those in between, and the tiles in
    /// memory.
    pub(crate) fn put_aside(&self, budget_bytes: f64, pauses: u32) -> f64 {
        self.replay(budget_bytes, pauses)[0].voxels
    }

    /// The size that is spilled, and the size held at the end.
    fn replay(&self, budget_bytes: f64, pauses: u32) -> [Size; 2] {
        let mut open: HashMap<TileId, Stay> = HashMap::new();
        let (mut held, mut aside, mut paused) = (Size::default(), Size::default(), 0);
        let steps = self.one_of as u64;
        let all = u64::from(self.scans.max(1)) * steps;
        for of_scan in self.seen.chunk_by(|a, b| a.scan == b.scan) {
            let mut tiles: BTreeMap<TileId, Vec<[i32; 3]>> = BTreeMap::new();
            for seen in of_scan {
                tiles.entry(self.tile_of(seen.voxel)).or_default().push(seen.voxel);
            }
            for step in 0..steps {
                let now = u64::from(of_scan[0].scan) * steps + step + 1;
                for (&tile, voxels) in &tiles {
                    let stay = open.entry(tile).or_default();
                    if step == 0 || stay.scans == 0.0 {
                        stay.voxels.extend(voxels);
                        stay.bricks.extend(voxels.iter().copied().map(brick_of));
                        stay.looked_at += 1.0;
                    }
                    stay.scans += 1.0;
                    stay.last = now;
                    held = held.less(stay.size);
                    stay.size = self.size_of(stay);
                    held = held.and(stay.size);
                }
                let due = now * u64::from(pauses) / all;
                if due > paused {
                    paused = due;
                    aside = aside.and(std::mem::take(&mut held));
                    open.clear();
                }
                if held.bytes > budget_bytes {
                    // The order of tiles within a scan is unknown, and so is when they are spilled. Ordered
                    // by their numbers, the same ones would be spilled each time.
                    let age = |(&tile, stay): (&TileId, &Stay)| {
                        (stay.last, hash([tile.x, tile.y, now as i32]), tile)
                    };
                    let mut ages: Vec<(u64, u64, TileId)> = open.iter().map(age).collect();
                    ages.sort_unstable();
                    for (_, _, tile) in ages {
                        if held.bytes <= budget_bytes * 0.75 {
                            break;
                        }
                        let size = open.remove(&tile).map_or(Size::default(), |stay| stay.size);
                        (held, aside) = (held.less(size), aside.and(size));
                    }
                }
            }
        }
        [aside, held]
    }

    /// The size of a tile while it stays in memory: the scans between the sampled ones add the less the more
    /// of these there are.
    fn size_of(&self, stay: &Stay) -> Size {
        let all = |seen: usize, Growth { of_two, of_all }: Growth| {
            let power = of_all + (of_two - of_all) / (1.0 + stay.looked_at);
            seen as f64 * self.part * libm::pow(stay.scans / stay.looked_at, power)
        };
        let voxels = all(stay.voxels.len(), self.growth[0]);
        Size { voxels, bytes: fused_bytes(voxels, all(stay.bricks.len(), self.growth[1])) }
    }
}

/// A tile while it stays in memory.
#[derive(Debug, Default)]
struct Stay {
    voxels: HashSet<[i32; 3]>,
    bricks: HashSet<[i32; 3]>,
    /// Scans in which it was seen, and how many of them were sampled.
    scans: f64,
    looked_at: f64,
    last: u64,
    size: Size,
}

/// Voxels and their memory, bytes.
#[derive(Debug, Default, Clone, Copy)]
struct Size {
    voxels: f64,
    bytes: f64,
}

impl Size {
    fn and(self, more: Self) -> Self {
        Self { voxels: self.voxels + more.voxels, bytes: self.bytes + more.bytes }
    }

    fn less(self, gone: Self) -> Self {
        Self { voxels: self.voxels - gone.voxels, bytes: self.bytes - gone.bytes }
    }
}

/// Returns that a voxel needs for a surfel.
const FILLED: u32 = 3;

/// Bricks are sampled whole or not at all.
fn brick_of(voxel: [i32; 3]) -> [i32; 3] {
    voxel.map(|c| c.div_euclid(BRICK_EDGE as i32))
}

/// Fibonacci hashing, number by number.
fn hash(numbers: [i32; 3]) -> u64 {
    numbers.iter().fold(0, |hash: u64, &c| {
        (hash ^ u64::from(c as u32)).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29)
    }) >> 7
}
