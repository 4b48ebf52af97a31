//! What the maps of all runs will take, in memory and on disk, estimated from some of the scans before any is fused.

use std::collections::{BTreeMap, HashMap, HashSet};

use dmp_map::{BRICK_EDGE, Lattice, TileId, fused_bytes};
use dmp_sensor::{Ray, Scan};

use crate::config::MapSource;
use crate::error::EvaluateError;
use crate::evaluation::Evaluation;
use crate::frames::{PlannedFrame, Worker, each_frame_of};
use crate::poser::Poser;
use crate::progress::{Progress, Stage};
use crate::run_poses::RunPoses;
use crate::run_state::{RunState, poses_of};

/// One of so many scans is looked at, or more where there are few.
const ONE_OF: usize = 16;
const LEAST_SCANS: usize = 64;
/// Voxels of scans that are held at most, about, those of all runs: 24 bytes each.
const MOST_SEEN: u64 = 1 << 18;
// Measured on simulated drives: docs/performance.md.

/// The voxels of a drive grow by as many with each doubling of its returns; a surfel needs about as many more returns than
/// a voxel as come in so many doublings.
const DOUBLINGS_TO_SURFEL: f64 = 2.2;
/// What some scans say of the maps that all of them will make.
#[derive(Debug)]
pub(crate) struct Sounding {
    /// Of each run whose map is fused from the scans.
    pub(crate) runs: Vec<SoundedRun>,
}

/// What they say of the map of one run.
#[derive(Debug)]
pub(crate) struct SoundedRun {
    /// In the order of time.
    seen: Vec<Seen>,
    /// Which of its sampled scans was last.
    scans: u32,
    /// One of so many scans was looked at, and of so many bricks.
    one_of: f64,
    part: f64,
    tile_edge_voxels: i32,
    /// How voxels grow in number with scans, and bricks.
    growth: [Growth; 2],
    /// Voxels of the whole map, surfels of it.
    pub(crate) voxels: f64,
    pub(crate) surfels: f64,
}

/// How places grow in number with the scans that see them: by the number of scans, to a power of 0 to 1.
#[derive(Debug, Clone, Copy, Default)]
struct Growth {
    /// Where two scans follow each other.
    of_two: f64,
    /// Over all of the run, of scans between those that were looked at.
    of_all: f64,
}

/// A voxel that a scan has returns in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Seen {
    /// The how many-eth of the scans looked at.
    scan: u32,
    voxel: [i32; 3],
    returns: u32,
}

impl<M: Sync + Send> Evaluation<'_, M> {
    /// Looks at some scans, evenly spread.
    ///
    /// # Errors
    /// When the log cannot be read.
    pub(crate) fn sound(&self) -> Result<Sounding, EvaluateError> {
        let is_fused = |run: &&RunState<'_, M>| run.run.map == MapSource::Fused;
        let fused: Vec<&RunPoses> = self.runs.iter().filter(is_fused).map(|run| &run.poses).collect();
        if fused.is_empty() {
            return Ok(Sounding { runs: Vec::new() });
        }
        let lattice = Lattice::new(self.plan.voxel.voxel_m)?;
        let frames = self.plan.frames();
        let one_of = (frames.len() / LEAST_SCANS).clamp(1, ONE_OF);
        let looked_at = frames.iter().step_by(one_of);
        let scans = looked_at.clone().count();
        let returns: u64 = looked_at.map(|frame| frame.returns).sum();
        let part = (returns * fused.len() as u64).div_ceil(MOST_SEEN).max(1);
        self.progress.begin(Stage::Survey, scans as u64);
        let worker = |_| Sounder {
            poser: Poser::new(poses_of(&self.runs), &self.plan.filter),
            numbers: (0..self.runs.len()).filter(|&run| is_fused(&&self.runs[run])).collect(),
            per_m: 1.0 / lattice.voxel_m(),
            one_of,
            part,
            seen: vec![Vec::new(); fused.len()],
            progress: self.progress,
        };
        let workers = (0..self.means.threads).map(worker).collect();
        let reading = self.plan.reading(self.log, &self.means, self.progress);
        let workers = each_frame_of(reading, |ordinal| ordinal.is_multiple_of(one_of), workers)?;
        let mut runs = vec![Vec::new(); fused.len()];
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

/// Looks at the scans of a thread.
struct Sounder<'e> {
    poser: Poser<'e>,
    /// Of the runs that are looked at.
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
        poser.blocks(frame, scan, |block| {
            for (&number, seen) in numbers.iter().zip(&mut *seen) {
                for end in block.rays(number).iter().map(Ray::endpoint_in_world) {
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

    /// How many there are in all scans, of those that are looked at and every second of these.
    fn grown(&self, all: f64, half: f64) -> f64 {
        all + libm::log2(self.one_of) * (all - half)
    }

    /// Voxels of every n-th scan that was looked at, and those with returns enough for a surfel.
    fn voxels_of(&self, every: u32) -> [f64; 2] {
        let mut voxels: HashMap<[i32; 3], u32> = HashMap::new();
        for seen in self.seen.iter().filter(|seen| seen.scan.is_multiple_of(every)) {
            *voxels.entry(seen.voxel).or_default() += seen.returns;
        }
        [voxels.len() as f64, voxels.values().filter(|&&returns| returns >= FILLED).count() as f64]
    }

    /// How places, each known by one of its voxels, grow in number.
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

    /// Surfels of every tile, about.
    pub(crate) fn surfels_of_tiles(&self) -> HashMap<TileId, f64> {
        let voxels: HashSet<[i32; 3]> = self.seen.iter().map(|seen| seen.voxel).collect();
        let of_one = self.surfels / voxels.len().max(1) as f64;
        let mut tiles = HashMap::new();
        for voxel in voxels {
            *tiles.entry(self.tile_of(voxel)).or_default() += of_one;
        }
        tiles
    }

    /// How many voxels are put aside while the map is fused in so much memory, with so many pauses in which all of them are:
    /// the scans that were looked at, each for those between too, and the tiles that they find in memory.
    pub(crate) fn put_aside(&self, budget_bytes: f64, pauses: u32) -> f64 {
        self.replay(budget_bytes, pauses)[0].voxels
    }

    /// What is put aside, and what is held at the end.
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
                    // Within a scan tiles are met in an order that is not known, and put aside at any time of it: by their
                    // numbers, the same ones would go each time.
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

    /// What a tile has while it stays in memory: the scans between those that were looked at bring the less the more of
    /// these there are.
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
    /// Scans that it was seen in, and how many of them were looked at.
    scans: f64,
    looked_at: f64,
    last: u64,
    size: Size,
}

/// Voxels and what they take in memory, bytes.
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

/// Bricks are looked at whole, or not at all.
fn brick_of(voxel: [i32; 3]) -> [i32; 3] {
    voxel.map(|c| c.div_euclid(BRICK_EDGE as i32))
}

/// Fibonacci hashing, one number after the other.
fn hash(numbers: [i32; 3]) -> u64 {
    numbers.iter().fold(0, |hash: u64, &c| {
        (hash ^ u64::from(c as u32)).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29)
    }) >> 7
}
