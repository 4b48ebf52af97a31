//! The score of a log: plan, fuse, cast, reduce.

use std::time::Instant;

use dmp_cast::Caster;
use dmp_log::ScanLog;
use dmp_map::Store;
use dmp_report::{PassTimes, Report};
use dmp_runs::{Config, EvaluateError, Heads, Run, Watch};

use crate::means::{Budget, Extent, peak};
use crate::passes::{DiskEstimate, Doubts, Evaluation, MapFacts, RunCaster, Scored, Task, tile_bytes};
use crate::results::{Findings, MapSummary, map_report};

/// Scores `runs` on `log`: plan, fuse, cast, reduce. `watch` follows the evaluation, or is `()`: see
/// [`Watch`].
///
/// Reads the log once, to fuse the maps, and keeps in the work folder the returns that are cast and those whose rays show
/// what moved. It is read once more where all returns are cast or the maps were given. [`Config::drift`] reads the scans
/// of revisits once more. A few scans are read before and in between. Runs are scored as given:
/// [`vet`](fn@crate::vet) detects runs that do not belong to the log, wrong clocks and wrong extrinsics. The
/// report is bit-identical for every number of threads, memory budget and reading order, except its `timing`,
/// its `memory` and the warning about a nearly full disk.
///
/// # Errors
/// When log and runs do not belong together, a file is too damaged to skip the damage, the work folder is
/// full, or a setting is invalid. Nothing is left behind then, except the checkpoint of
/// [`Config::checkpoint_every`]: the watcher receives its path.
pub fn evaluate<'a>(
    log: &'a dyn ScanLog,
    runs: &'a [Run],
    config: &Config,
    watch: impl Into<Watch<'a>>,
) -> Result<Report, EvaluateError> {
    evaluate_look(log, runs, config, 1, watch.into())
}

/// One of so many looks, which share the error rate.
pub(crate) fn evaluate_look<'a>(
    log: &'a dyn ScanLog,
    runs: &'a [Run],
    config: &Config,
    looks: u32,
    watch: Watch<'a>,
) -> Result<Report, EvaluateError> {
    Task::open(log, runs, config, watch)?.keeping(|task| score(task, runs, looks))
}

/// Whether the memory is enough for the threads, the runs and the largest scan of a log: what is known before a scan is read.
///
/// # Errors
/// When it is not, or a setting is wrong.
pub fn check_memory(log: &dyn ScanLog, runs: &[Run], config: &Config) -> Result<(), EvaluateError> {
    let (settings, means) = config.on(log.summary())?;
    let least = Extent { runs: runs.len(), poses: 0, tiles: 0 };
    if Budget::new(log, least, &means).is_ok() {
        return Ok(());
    }
    // What is said to be needed is enough.
    Budget::new(log, Extent::of_runs(runs, &settings, &means)?, &means).map(|_| ())
}

/// Plan, fuse, cast, reduce.
fn score<'a>(task: Task<'a>, runs: &'a [Run], looks: u32) -> Result<Report, EvaluateError> {
    let mut times = Stopwatch::start();
    // Each run in its own canonical frame, with its own segments; the same returns z and voxels for all.
    let planned = task.plan(runs)?;
    let sounding = planned.sound()?;
    planned.foresee_tiles(&sounding)?;
    let disk = planned.foresee_disk(&sounding)?;
    times.of.plan_s = times.lap_s();

    // M: each run's surfel map, fused from the scans with its trajectory, or given.
    let fused = planned.fuse()?;
    fused.holds_the_densest_tile()?;
    times.of.fuse_s = times.lap_s();

    // Without what moved: surfels that rays of the same pass go through.
    let fused = fused.without_trails()?;
    times.of.trails_s = times.lap_s();

    // z' = S(M, T_z) for the drawn returns of every scan (eq. 6–7), and Σ (z − z')² (eq. 13).
    let kept = fused.keep_if_due()?;
    let (mut maps, tiles) = fused.casters();
    maps.doubt()?;
    let mut scored = maps.cast(&tiles, &kept)?;
    drop(tiles);
    maps.account(&mut scored)?;
    scored.confidence = scored.confidence.of_each_look(looks);
    peak::look();
    times.of.cast_s = times.lap_s();

    // Drift at revisits, in metres.
    let drift = if maps.measures_drift() { Some(maps.drift()?) } else { None };
    times.of.drift_s = times.lap_s();

    let mut report = maps.report(&scored, disk, times.stop(maps.means.threads));
    report.add_drift(drift);
    let stores: Vec<&Store> = maps.runs.iter().map(|run| run.map.caster.map()).collect();
    maps.sink.scored(&report, &stores);
    peak::look();
    report.memory.peak_anon_bytes = peak::peak_anonymous_bytes();
    Ok(report)
}

impl RunCaster {
    /// The caster into a given map, and what is known about that map.
    fn given(&self) -> Option<(&Caster, &MapFacts)> {
        (!self.facts.fused).then_some((&self.caster, &self.facts))
    }

    fn summary(&self) -> MapSummary {
        MapSummary { report: map_report(self.caster.map(), &self.facts), facts: self.facts.clone() }
    }
}

impl Evaluation<'_, RunCaster> {
    /// Warns about runs and given maps that seem not to belong together, before the long part.
    fn doubt(&mut self) -> Result<(), EvaluateError> {
        let Self { log, plan, settings, progress, runs, .. } = self;
        Doubts { log: *log, plan, settings, progress: *progress }.look(runs, RunCaster::given)
    }

    fn report(&self, scored: &Scored, disk: DiskEstimate, timing: PassTimes) -> Report {
        let findings = Findings {
            heads: Heads::Log(self.log),
            damage: &self.log.summary().damage,
            settings: &self.settings,
            means: &self.means,
            plan: &self.plan,
            runs: &self.runs.iter().map(|run| run.like(run.map.summary())).collect::<Vec<_>>(),
            fused: self.fused,
            scored,
            timing,
        };
        let mut report = findings.report();
        let fused = self.runs.iter().filter(|run| run.map.facts.fused);
        let map_bytes: u64 = fused.map(|run| tile_bytes(run.map.caster.map())).sum();
        report.memory.disk_bytes_estimated = disk.bytes;
        report.memory.disk_bytes = report.memory.scratch_bytes + map_bytes;
        report.warnings.extend(disk.warning);
        report
    }
}

/// Measures the duration of the passes.
struct Stopwatch {
    start: Instant,
    lap: Instant,
    of: PassTimes,
}

impl Stopwatch {
    fn start() -> Self {
        let now = Instant::now();
        Self { start: now, lap: now, of: PassTimes::default() }
    }

    fn lap_s(&mut self) -> f64 {
        std::mem::replace(&mut self.lap, Instant::now()).elapsed().as_secs_f64()
    }

    fn stop(self, threads: usize) -> PassTimes {
        PassTimes { total_s: self.start.elapsed().as_secs_f64(), threads, ..self.of }
    }
}
