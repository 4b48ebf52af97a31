//! A quick score: of a sample of places along the way, each by itself, so that only the scans that see them are read.

mod draw;
mod scans;
mod score;
mod survey;
mod way;

use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use dmp_log::{Damage, LogOutline};
use dmp_map::WorkFolder;
use dmp_reduce::{Basis, FrameSums, Layout, Reducer};
use dmp_sensor::DropReason;

use crate::cast::Scored;
use crate::config::{Config, MapSource, Run};
use crate::error::EvaluateError;
use crate::fuse::Maps;
use crate::memory::{self, Budget};
use crate::own_frame::Placed;
use crate::plan::{Drive, Heads, Plan};
use crate::pose::Pairing;
use crate::report::{self, Inputs, PassTimes, PlacesReport, Report};
use crate::sample::{Looks, Sample};
use crate::watch::{Stage, Watch};
pub use draw::drawn_places;
use draw::{FEW_PLACES, draw};
use scans::DriveScans;
use score::{PlaceScorer, PlaceTotals};
use survey::Surveyed;
use way::{LENGTH_M, PlaceScans, SPACING_M, Way};

/// A place of a quick score.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ScoredPlace {
    /// Its number along the way, from 0.
    pub number: usize,
    /// How many places there are.
    pub of: usize,
    /// Whether most runs have the way come back to it.
    pub is_revisited: bool,
}

/// Places below which there is nothing to choose among.
const FEWEST_PLACES: usize = 4;
/// Stamps that are known no better than this, nanoseconds, do not tell where a scan was made.
const VAGUE_NS: i64 = 1_000_000_000;
/// What a return takes in memory while it is held, bytes: coordinates and a time.
const HELD_RETURN_BYTES: u64 = 20;
/// Least memory for the maps of a thread beside what it cannot do without, bytes.
const LEAST_MAP_BYTES: usize = 32 << 20;

/// Scores `runs` on a sample of places of the log that `outline` tells of, drawn by [`Config::seed`], and reads about
/// `share` of its bytes: the scans near these places, on every pass.
///
/// A place is ten metres of the way with all passes over it. Its map is made of the scans within 35 m that any run
/// puts there, every four metres; its own scans, as far apart, are scored. Places do not depend on each other, so the
/// error of the sampling is that of so many units drawn from all places. What differs from [`evaluate`](crate::evaluate)
/// is measured in `docs/accuracy.md`.
///
/// # Errors
/// As [`evaluate`](crate::evaluate); when the drive has too few places, when the stamps in the log's index do not tell
/// where scans were made, and for settings that need the whole log.
pub fn evaluate_quick(
    outline: &LogOutline,
    runs: &[Run],
    config: &Config,
    share: f64,
    watch: &dyn Watch,
) -> Result<Report, EvaluateError> {
    let config = &config.settled(outline.summary());
    config.check()?;
    check(runs, config, share)?;
    let start = Instant::now();
    let read_before = outline.bytes_read();
    let placed = Placed::new(Heads::Outline(outline), runs, &[], config)?;
    let runs = placed.runs.as_slice();
    let drive = Drive::new(Heads::Outline(outline), runs, config)?;
    let by_stamp = drive.poses.iter().any(|run| run.pairing == Pairing::ByStamp);
    if by_stamp && outline.stamp_error_ns() > VAGUE_NS {
        let (path, error_ns) = (outline.summary().path.clone(), outline.stamp_error_ns());
        return Err(EvaluateError::VagueStamps { path, error_s: error_ns as f64 / 1e9 });
    }
    let scans = DriveScans::new(outline, &drive);
    let way = Way::new(&scans);
    let sample = Places::choose(&scans, &way, config, share)?;

    // The same returns z, voxels and segments for every run and every place.
    let (all, drawn) = (sample.total as u64, sample.drawn.len() as u64);
    let looks = Looks::new(all, Sample::Frames(drawn), config.seed, false);
    let surveyed = survey::look(&scans, &way, &sample.drawn, &placed, looks, config, watch)?;
    let Surveyed { plan, hints, largest_scan } = surveyed;
    let most_scans = sample.drawn.iter().map(|(_, scans)| scans.read.len()).max().unwrap_or(0);
    let held_bytes = most_scans as u64 * largest_scan * HELD_RETURN_BYTES;
    let plan_s = start.elapsed().as_secs_f64();

    // Every place as a log of its own: its map, and the sums of its returns. The places are the units that the error
    // of the sampling comes from.
    let layout = Layout::new(all, vec![Basis::CrossValidated; runs.len()]).with_miss_price(config.miss_price);
    let pass = Pass { scans: &scans, plan: &plan, runs, config, held_bytes, largest_scan, watch };
    let (reducer, totals, threads) = pass.run(&sample.drawn, &layout)?;
    let mut counts = totals.scored;
    counts.add_dropped(DropReason::ScanNotSampled, totals.fused.total().saturating_sub(counts.total()));
    counts.add_dropped(DropReason::ScanWithoutPose, totals.unposed_returns);
    let Some(lattice) = totals.lattice.filter(|_| counts.used() > 0) else {
        return Err(EvaluateError::NoReturns(report::drops_in_words(&counts)));
    };
    memory::look();

    let total_s = start.elapsed().as_secs_f64();
    let times = PassTimes {
        plan_s,
        fuse_s: totals.fuse_s / threads as f64,
        trails_s: 0.0,
        cast_s: totals.cast_s / threads as f64,
        total_s,
        threads: config.threads,
    };
    let since = outline.bytes_read().zip(read_before).map(|(now, before)| now - before);
    let bytes_read = since.zip(outline.own_bytes_read()).map(|(since, own)| since + own);
    let maps = Maps {
        of_runs: Vec::new(),
        counts: Some(totals.fused),
        left_out: 0,
        trails: None,
        scratch_bytes: totals.scratch_bytes,
        notes: vec![Vec::new(); runs.len()],
    };
    // A place has its maps by itself: their tiles are what is in reach, once.
    let tiles_in_reach = totals.maps.iter().map(|map| map.tiles).sum();
    let scored = Scored {
        frames: totals.scans_scored,
        places: Some(sample.report(&way, share, totals.scans_read, bytes_read)),
        scan_of_unit: sample.middles,
        looks: vec![reducer.frames_added()],
        promise: config.promise(),
        counts,
        tiles: totals.tiles,
        tile_loads: totals.tile_loads,
        tiles_in_reach,
        tile_visits: tiles_in_reach,
        lattice,
        reducer,
    };
    let damage = all_damage(outline, totals.damage);
    let inputs = Inputs { heads: Heads::Outline(outline), damage: &damage, runs };
    let mut report = report::build(inputs, config, &plan, &maps, totals.maps, &scored, &hints, times);
    report.memory.disk_bytes = totals.scratch_bytes + totals.map_bytes;
    Ok(report)
}

/// What of the log is lost, as far as was seen: in the order of the places, whichever thread had them.
fn all_damage(outline: &LogOutline, mut of_places: Vec<(usize, Damage)>) -> Vec<Damage> {
    of_places.sort_by_key(|(place, _)| *place);
    let mut damage = outline.damage().to_vec();
    for (_, lost) in of_places {
        if !damage.contains(&lost) {
            damage.push(lost);
        }
    }
    damage
}

/// What a sample of places cannot do.
fn check(runs: &[Run], config: &Config, share: f64) -> Result<(), EvaluateError> {
    let bad = |value: String, why| Err(EvaluateError::Setting { setting: "quick", value, why });
    if !(share > 0.0 && share <= 1.0) {
        return bad(format!("{share}"), "it must be a share of the log's bytes above 0 and at most 1");
    }
    if !config.scales().lengths().has_quick {
        return bad(
            format!("of a {}", config.scales().lengths().name),
            "its places are those of a drive, 10 m long: --sample scores part of the scans",
        );
    }
    if runs.iter().any(|run| run.map != MapSource::Fused) {
        return bad(
            "with a given map".into(),
            "it makes the maps of places itself: --sample scores part of the scans",
        );
    }
    if config.sample != Sample::All || config.decide.is_some() {
        return bad("with a sample of scans".into(), "it is one or the other");
    }
    if config.free_space || config.save_maps.is_some() || config.checkpoint_every.is_some() || config.resume {
        return bad("with a setting for whole maps".into(), "it makes maps of places, and none of all");
    }
    Ok(())
}

/// The places that are scored.
struct Places {
    /// How many there are, and how many of these are passed more than once.
    total: usize,
    revisited_total: usize,
    /// Those drawn, and what is read for each.
    drawn: Vec<(ScoredPlace, PlaceScans)>,
    /// For every place the number in the log of the scan in its middle.
    middles: Vec<usize>,
}

impl Places {
    fn choose(
        drive_scans: &DriveScans<'_>,
        way: &Way,
        config: &Config,
        share: f64,
    ) -> Result<Self, EvaluateError> {
        let places = way.places();
        let (outline, drive) = (drive_scans.outline(), drive_scans.drive());
        if places.len() < FEWEST_PLACES {
            let travel_m = drive.segments.travel_m;
            return Err(EvaluateError::NoPlaces { travel_m, places: places.len() });
        }
        let mut scans: Vec<PlaceScans> = places.iter().map(|place| way.scans_of(place)).collect();
        let bytes: Vec<u64> = scans.iter().map(|place| drive_scans.bytes_of(&place.read)).collect();
        let asked = (share * outline.bytes() as f64) as u64;
        let read = outline.own_bytes_read().unwrap_or(0) + survey::bytes(outline);
        // All of the log is all places, though most scans are read for several of them.
        let budget_bytes = if share < 1.0 { asked.saturating_sub(read) } else { u64::MAX };
        let revisited: Vec<bool> = places.iter().map(|place| way.is_revisited(place)).collect();
        let numbers = draw(&bytes, &revisited, budget_bytes, config.seed);
        Ok(Self {
            total: places.len(),
            revisited_total: revisited.iter().filter(|&&revisited| revisited).count(),
            middles: places.iter().map(|place| drive.frames()[place.centre].number).collect(),
            drawn: numbers
                .into_iter()
                .map(|number| {
                    let is_revisited = revisited[number];
                    let place = ScoredPlace { number, of: places.len(), is_revisited };
                    (place, std::mem::take(&mut scans[number]))
                })
                .collect(),
        })
    }

    fn report(&self, way: &Way, share: f64, scans_read: u64, bytes_read: Option<u64>) -> PlacesReport {
        PlacesReport {
            drawn: self.drawn.len() as u64,
            total: self.total as u64,
            revisited: self.drawn.iter().filter(|(place, _)| place.is_revisited).count() as u64,
            revisited_total: self.revisited_total as u64,
            cut: self.drawn.iter().filter(|(_, scans)| scans.cut).count() as u64,
            length_m: LENGTH_M,
            radius_m: way.radius_m(),
            spacing_m: SPACING_M,
            scans_read,
            are_fewest: self.drawn.len() <= FEW_PLACES,
            share_asked: share,
            bytes_read,
        }
    }
}

/// What threads share.
struct Pass<'a> {
    scans: &'a DriveScans<'a>,
    plan: &'a Plan<'a>,
    runs: &'a [Run],
    config: &'a Config,
    /// Most bytes that the scans of a place take in memory.
    held_bytes: u64,
    /// Most returns of a scan, as far as is known.
    largest_scan: u64,
    watch: &'a dyn Watch,
}

impl Pass<'_> {
    /// Scores places, one of them a thread. Says how many threads there were.
    fn run(
        &self,
        drawn: &[(ScoredPlace, PlaceScans)],
        layout: &Layout,
    ) -> Result<(Reducer, PlaceTotals, usize), EvaluateError> {
        let (threads, config) = self.shares(drawn.len())?;
        // What every place writes goes into folders of its own in this one.
        let folder = WorkFolder::new(&self.config.work_folder).map_err(EvaluateError::Work)?;
        let config = Config { work_folder: folder.path().to_path_buf(), ..config };
        self.watch.begin(Stage::Places, drawn.len() as u64);
        let next = AtomicUsize::new(0);
        let work = || -> Result<(Reducer, PlaceTotals), EvaluateError> {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
            let pool = pool.map_err(|source| EvaluateError::Threads { threads: 1, source })?;
            let scorer = PlaceScorer {
                scans: self.scans,
                plan: self.plan,
                runs: self.runs,
                config: &config,
                watch: self.watch,
            };
            let (mut reducer, mut totals) = (Reducer::new(layout.clone()), PlaceTotals::new(self.runs.len()));
            while let Some((place, scans)) = drawn.get(next.fetch_add(1, Ordering::Relaxed)) {
                if self.watch.cancelled() {
                    return Err(EvaluateError::Cancelled);
                }
                let sums: FrameSums = pool.install(|| scorer.score(place.number, scans, &mut totals))?;
                reducer.add_frame(place.number as u64, &sums)?;
                self.watch.place_scored(*place, &sums);
                self.watch.advance(1);
            }
            Ok((reducer, totals))
        };
        // Where one fails, the others begin no other place.
        let stop = |_: &EvaluateError| next.store(drawn.len(), Ordering::Relaxed);
        let done: Vec<Result<(Reducer, PlaceTotals), EvaluateError>> = std::thread::scope(|scope| {
            let threads: Vec<_> = (0..threads).map(|_| scope.spawn(|| work().inspect_err(stop))).collect();
            let resume = |panic| std::panic::resume_unwind(panic);
            threads.into_iter().map(|thread| thread.join().unwrap_or_else(resume)).collect()
        });
        let (mut reducer, mut totals) = (Reducer::new(layout.clone()), PlaceTotals::new(self.runs.len()));
        for of_thread in done {
            let (of_thread, more) = of_thread?;
            reducer.merge(&of_thread)?;
            totals.merge(more);
        }
        Ok((reducer, totals, threads))
    }

    /// As many threads as the memory allows, and the settings of each.
    fn shares(&self, places: usize) -> Result<(usize, Config), EvaluateError> {
        let asked = self.config.memory_bytes;
        let row_bytes = self.scans.outline().summary().point_bytes as usize;
        let least = Budget::least_bytes(self.largest_scan as usize, row_bytes, self.runs.len());
        let needed = self.held_bytes as usize + least + LEAST_MAP_BYTES;
        if asked < needed {
            return Err(EvaluateError::TooLittleMemory { asked, needed, threads: 1, runs: self.runs.len() });
        }
        let threads = (asked / needed).min(self.config.threads).min(places).max(1);
        let memory_bytes = asked / threads - self.held_bytes as usize;
        Ok((threads, Config { threads: 1, memory_bytes, ..self.config.clone() }))
    }
}
