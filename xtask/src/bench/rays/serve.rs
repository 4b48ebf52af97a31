//! The caster in Rust as a process that casts on request, for python/bench/rays.py.
//!
//! One line of input is one request: `load` reads the rays and answers `ok`, `build` opens the map, casts one ray in a thousand and
//! answers with the seconds, `go WAY THREADS` casts all rays once and answers with the seconds, `ranges FILE` writes the first range
//! of each, NaN for a miss, and answers `ok`. The end of input ends it.

use std::io::{BufRead as _, Write as _};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use anyhow::{Context as _, anyhow, bail};
use clap::Args;
use dmp_cast::{Answer, CastBuffers, CastSettings, Caster, Query, TileCache, Wanted};
use dmp_map::{MapError, Store};
use dmp_sensor::{Point3, Vector3};

use super::make::Files;
use super::npy;

/// Rays that are cast at once, as by `dmp score`.
const BLOCK_RAYS: usize = 32_768;

/// Cast on request: what `bench rays` starts
#[derive(Debug, Clone, Args)]
pub(crate) struct ServeArgs {
    folder: PathBuf,
}

/// Casters into one map, and rays as they take them.
#[derive(Debug)]
struct Casting {
    first: Caster<Store>,
    three: Caster<Store>,
    rays: Rays,
}

/// Rays as casters take them.
#[derive(Debug)]
struct Rays {
    measured: Vec<Query>,
    /// The same where nothing was measured.
    unmeasured: Vec<Query>,
}

/// Of one thread.
#[derive(Debug, Default)]
struct Buffers {
    answers: Vec<Answer>,
    normals: Vec<Option<[f32; 3]>>,
    of_caster: CastBuffers,
}

/// What is asked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Way {
    First,
    Measured,
    Normals,
}

pub(crate) fn run(arguments: &ServeArgs) -> anyhow::Result<()> {
    let files = Files::of(&arguments.folder);
    let mut rays = None;
    let mut casting = None;
    for line in std::io::stdin().lock().lines() {
        let line = line?;
        let words: Vec<&str> = line.split(' ').collect();
        let answer = match (words.as_slice(), &casting) {
            (["load"], _) => {
                rays = Some(Rays::load(&files)?);
                "ok".to_owned()
            }
            (["build"], _) => {
                let start = Instant::now();
                let built = Casting::open(&files, rays.take().context("no rays are loaded")?)?;
                let some: Vec<Query> = built.rays.unmeasured.iter().copied().step_by(1000).collect();
                built.first.cast(&some, &mut Vec::new(), &mut CastBuffers::default())?;
                casting = Some(built);
                start.elapsed().as_secs_f64().to_string()
            }
            (["go", way, threads], Some(casting)) => {
                casting.cast_s(way_of(way)?, threads.parse()?)?.to_string()
            }
            (["ranges", path], Some(casting)) => {
                npy::write(Path::new(path), &casting.ranges()?)?;
                "ok".to_owned()
            }
            _ => bail!("{line}: unknown request"),
        };
        let mut out = std::io::stdout().lock();
        writeln!(out, "{answer}")?;
        out.flush()?;
    }
    Ok(())
}

fn way_of(word: &str) -> anyhow::Result<Way> {
    Ok(match word {
        "first" => Way::First,
        "measured" => Way::Measured,
        "normals" => Way::Normals,
        _ => bail!("{word}: unknown way"),
    })
}

impl Rays {
    /// Those of the files, in the frame of their trajectory.
    fn load(files: &Files) -> anyhow::Result<Self> {
        let (origins, directions) = (npy::read::<3>(&files.origins)?, npy::read::<3>(&files.directions)?);
        let ranges = npy::read::<1>(&files.ranges)?;
        let rays = origins.into_iter().zip(directions).zip(ranges);
        let query = |((origin, direction), [measured_m]): (([f64; 3], [f64; 3]), [f64; 1])| Query {
            origin_in_world_m: origin,
            direction_in_world: direction,
            measured_m,
            segment: None,
        };
        let measured: Vec<Query> = rays.map(query).collect();
        let unmeasured = measured.iter().map(|ray| Query { measured_m: f64::INFINITY, ..*ray }).collect();
        Ok(Self { measured, unmeasured })
    }
}

impl Casting {
    fn open(files: &Files, mut rays: Rays) -> anyhow::Result<Self> {
        let store = Store::open(&files.map)?;
        let world_from_own = store.own_from_world().inverse();
        for ray in rays.measured.iter_mut().chain(&mut rays.unmeasured) {
            ray.origin_in_world_m = (world_from_own * Point3::from(ray.origin_in_world_m)).into();
            ray.direction_in_world = (world_from_own * Vector3::from(ray.direction_in_world)).into();
        }
        let tiles = Arc::new(TileCache::new(usize::MAX));
        let first_only = CastSettings { wanted: Wanted::First, ..CastSettings::default() };
        Ok(Self {
            first: Caster::sharing(Store::open(&files.map)?, first_only, &tiles, 0),
            three: Caster::sharing(store, CastSettings::default(), &tiles, 0),
            rays,
        })
    }

    /// Casts all rays once; seconds of the casting, answers written into lists of a block.
    fn cast_s(&self, way: Way, threads: usize) -> anyhow::Result<f64> {
        let queries = if way == Way::Measured { &self.rays.measured } else { &self.rays.unmeasured };
        let start = Instant::now();
        let blocks = Mutex::new(queries.chunks(BLOCK_RAYS));
        let next = || blocks.lock().unwrap_or_else(PoisonError::into_inner).next();
        let work = || {
            let mut buffers = Buffers::default();
            std::iter::from_fn(next).try_for_each(|block| self.cast(way, block, &mut buffers))
        };
        std::thread::scope(|scope| {
            let others: Vec<_> = (1..threads).map(|_| scope.spawn(work)).collect();
            work()?;
            for other in others {
                other.join().map_err(|_| anyhow!("a thread ended early"))??;
            }
            Ok::<_, anyhow::Error>(())
        })?;
        Ok(start.elapsed().as_secs_f64())
    }

    fn cast(&self, way: Way, block: &[Query], buffers: &mut Buffers) -> Result<(), MapError> {
        let Buffers { answers, normals, of_caster } = buffers;
        match way {
            Way::First => self.first.cast(block, answers, of_caster),
            Way::Measured => self.three.cast(block, answers, of_caster),
            Way::Normals => self.first.cast_with_normals(block, answers, normals, of_caster),
        }
    }

    fn ranges(&self) -> Result<Vec<[f64; 1]>, MapError> {
        let (mut ranges, mut buffers) = (Vec::with_capacity(self.rays.unmeasured.len()), Buffers::default());
        for block in self.rays.unmeasured.chunks(BLOCK_RAYS) {
            self.cast(Way::First, block, &mut buffers)?;
            ranges.extend(buffers.answers.iter().map(|answer| [answer.first_m.unwrap_or(f64::NAN)]));
        }
        Ok(ranges)
    }
}
