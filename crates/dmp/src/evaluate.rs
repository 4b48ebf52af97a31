use std::time::Instant;

use dmp_cast::Caster;
use dmp_log::ScanLog;
use dmp_map::Store;
use dmp_sensor::DropReason;

use crate::cast::{CastPass, Casters};
use crate::checkpoint::Work;
use crate::config::{Config, Run};
use crate::error::EvaluateError;
use crate::own_frame::Placed;
use crate::plan::{Heads, Plan};
use crate::report::{Inputs, PassTimes, Report, Warning};
use crate::watch::Watch;
use crate::{fuse, given, memory, report, sanity, trails};

/// Scores `runs` on `log`: plan, fuse, cast, reduce.
///
/// Reads the log twice, to fuse the maps and to cast the rays, or with [`Config::sample`] once and the
/// scans of the sample again; four times with [`Config::free_space`]. A few scans are read before and in
/// between. The report is the same to the bit for every number of threads, memory budget and order of
/// reading, but for its `timing` and `memory`, and a warning of a disk that is nearly full.
///
/// # Errors
/// When log and runs do not belong together, a file is damaged beyond what can be left out, the work
/// folder is full, or a setting makes no sense. Nothing is left behind then, but with
/// [`Config::checkpoint_every`] what was kept: `watch` is told where it is.
pub fn evaluate(
    log: &dyn ScanLog,
    runs: &[Run],
    config: &Config,
    watch: &dyn Watch,
) -> Result<Report, EvaluateError> {
    let config = &config.settled(log.summary());
    config.check()?;
    given::check_free_space(runs, config)?;
    let work = Work::open(log, runs, config)?;
    let (report, _) = work.within(watch, |work| evaluate_in(work, log, runs, config, watch))?;
    Ok(report)
}

/// Plan, fuse, cast, reduce.
fn evaluate_in(
    work: &Work,
    log: &dyn ScanLog,
    runs: &[Run],
    config: &Config,
    watch: &dyn Watch,
) -> Result<Report, EvaluateError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(config.threads).build();
    let pool = pool.map_err(|source| EvaluateError::Threads { threads: config.threads, source })?;
    let start = Instant::now();
    let mut lap = start;
    let mut lap_s = || std::mem::replace(&mut lap, Instant::now()).elapsed().as_secs_f64();

    // Every run in a frame of its own making; the same returns z, voxels and segments for all.
    let stores = given::given_stores(runs)?;
    let voxel_m = given::voxel_of_stores(runs, &stores, config.voxel_m)?.or(config.voxel_m);
    let placed = Placed::new(Heads::Log(log), runs, &stores, config)?;
    let runs = placed.runs.as_slice();
    let plan = Plan::new(log, runs, &placed.own_from_world, &Config { voxel_m, ..config.clone() }, watch)?;
    let (room, room_warning) = work.look_for_room(log, &plan, runs, config, watch)?;
    let plan_s = lap_s();

    // M: each run's surfel map, fused from the scans with its trajectory, or given.
    let kept = fuse::reopen_without_trails(work, runs)?;
    let trails_kept = kept.is_some();
    let mut maps = match kept {
        Some(maps) => maps,
        None => pool.install(|| fuse::maps_of(log, &plan, runs, stores, None, config, work, watch))?,
    };
    let fuse_s = lap_s();

    // Where asked for: the same without the returns on trails, which the rays of the log pass through.
    if config.free_space && !trails_kept {
        fuse::keep_if_due(work, &maps)?;
        maps = pool.install(|| trails::keep_out(log, &plan, runs, maps, config, work, watch))?;
    }
    let trails_s = lap_s();
    let as_kept = fuse::keep_if_due(work, &maps)?;

    // z' = S(M, T_z) for every return of every scan (eq. 6–7), and Σ (z − z')² (eq. 13).
    let run_maps = std::mem::take(&mut maps.of_runs);
    let map_reports = report::map_reports(&run_maps, maps.trails.as_ref());
    let map_bytes = fuse::fused_bytes(&run_maps);
    let casters = Casters::new(run_maps, config, work.budget());
    // Where they hardly belong together: what is likely wrong, told before the long part.
    let stretches = sanity::stretches(&plan, config);
    let hints = sanity::look(log, &plan, &stretches, placed.as_given, &casters.given(), config, watch)?;
    let (plan, casters) = (&plan, &casters);
    let pass = CastPass { log, plan, runs, casters, config, work, watch };
    let mut scored = pass.run(&as_kept)?;
    let cast_s = lap_s();

    // What was fused was cast, unless only a sample was.
    let all_scored = scored.reducer.frames_added() == plan.frames().len() as u64;
    if let Some(first) = maps.counts.filter(|first| all_scored && *first != scored.counts) {
        return Err(EvaluateError::LogChanged { first: first.used(), second: scored.counts.used() });
    }
    // Every return of the log is used or dropped for a reason.
    let not_sampled = plan.returns().saturating_sub(scored.counts.total());
    scored.counts.add_dropped(DropReason::ScanNotSampled, not_sampled);
    scored.counts.add_dropped(DropReason::ScanNotSelected, plan.selection.unselected_returns);
    scored.counts.add_dropped(DropReason::ScanWithoutPose, plan.selection.unposed_returns);
    if scored.counts.used() == 0 {
        return Err(EvaluateError::NoReturns(report::drops_in_words(&scored.counts)));
    }
    memory::look();
    let total_s = start.elapsed().as_secs_f64();
    let times = PassTimes { plan_s, fuse_s, trails_s, cast_s, total_s, threads: config.threads };
    let inputs = Inputs { heads: Heads::Log(log), damage: &log.summary().damage, runs };
    let mut report = report::build(inputs, config, plan, &maps, map_reports, &scored, &hints, times);
    report.memory.disk_bytes_estimated = room.bytes();
    report.memory.disk_bytes = report.memory.scratch_bytes + map_bytes;
    report.warnings.extend(room_warning.map(Warning::Other));
    let maps: Vec<&Store> = casters.of_runs.iter().map(Caster::map).collect();
    watch.scored(&report, &maps);
    memory::look();
    report.memory.peak_anon_bytes = memory::peak_anonymous_bytes();
    Ok(report)
}
