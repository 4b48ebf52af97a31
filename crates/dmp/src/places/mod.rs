//! A quick score: scores a sample of places along the path one by one, so that only their scans are read.

mod choice;
mod draw;
mod drive;
mod pass;
mod scans;
mod score;
mod survey;
mod way;
mod whereabouts;

use std::time::Instant;

use dmp_log::{Damage, LogOutline};
use dmp_map::Store;
use dmp_reduce::{Comparison, Verdict};
use dmp_report::{Pairing, PassTimes, Report};
use dmp_runs::{
    Config, EvaluateError, Heads, MapSource, Means, PosedRun, Run, Selection, SettingName, Settings, Watch,
    apart_of, check_runs, own_frame, pool,
};
use dmp_sensor::DropReason;

use crate::means::peak;
use crate::passes::{FuseTotals, MapFacts, Scored};
use crate::results::{Findings, MapSummary, drops_in_words};
use choice::Places;
pub use choice::Quick;
use drive::Drive;
use pass::{Pass, PlaceSums};
use scans::DriveScans;
use way::Way;

/// Stamps with a larger uncertainty, nanoseconds, do not locate a scan.
const VAGUE_NS: i64 = 1_000_000_000;

/// Scores `runs` on a sample of places of the log that `outline` describes, drawn by [`Config::seed`]. Reads
/// about as much as `quick` says: the scans near these places, on every pass.
///
/// A place is ten metres of the path with all passes over it. Its map uses the scans that any run puts within
/// 35 m, one every four metres; its own scans, at the same spacing, are scored. Places are independent, so
/// the sampling error is that of as many units drawn from all places. `docs/accuracy.md` measures the
/// differences from [`evaluate`](crate::evaluate).
///
/// # Errors
/// As [`evaluate`](crate::evaluate); when the drive has too few places, when the stamps in the log's index do
/// not locate scans, and for settings that need the whole log.
pub fn evaluate_quick<'a>(
    outline: &'a LogOutline,
    runs: &'a [Run],
    config: &Config,
    quick: Quick,
    watch: impl Into<Watch<'a>>,
) -> Result<Report, EvaluateError> {
    let watch = watch.into();
    let (settings, means) = config.on(outline.summary())?;
    check(runs, &settings, &means, quick)?;
    let start = Instant::now();
    let read_before = outline.bytes_read();
    let heads = Heads::Outline(outline);
    let (selection, drive, placed) = placed(outline, runs, &settings)?;
    let scans = DriveScans::new(outline, &drive, &placed);
    let way = Way::new(&scans);
    let sample = Places::choose(&scans, &way, settings.seed, quick)?;

    // The same returns z and voxels for every run and every place.
    let pool = pool(means.threads)?;
    let (plan, largest_scan) = survey::look(&scans, selection, &settings, (&pool, watch.progress))?;
    drop(pool);
    let plan_s = start.elapsed().as_secs_f64();

    // Every place is scored like a separate log: its own map and sums. Places are the units of the sampling
    // error. All looks share the error rate (Bonferroni's inequality).
    let pass = Pass {
        scans: &scans,
        plan: &plan,
        largest_scan,
        asked: runs,
        settings: &settings,
        means: &means,
        watch,
    };
    let confidence = settings.confidence.of_each_look(sample.looks.len() as u32);
    let ruler = plan.ruler(outline.summary(), &settings);
    let is_open = |pair: &Comparison| {
        let apart = || apart_of(plan.frames(), [pair.a, pair.b].map(|run| &placed[run]), &ruler);
        matches!(pair.verdict, Verdict::Undecided { .. })
            && !apart().is_some_and(|apart| apart.is_same(pair.basis, settings.same_within_m))
    };
    let sums = pass.run(&sample.looks, sample.total as u64, |reducer| {
        !reducer.comparisons(confidence).pairs.iter().any(is_open)
    })?;
    let PlaceSums { reducer, totals, looks, threads } = sums;
    let mut counts = totals.scored;
    counts.add_dropped(DropReason::ScanNotSampled, totals.fused.total().saturating_sub(counts.total()));
    counts.add_dropped(DropReason::ScanWithoutPose, totals.unposed_returns);
    let Some(lattice) = totals.lattice.filter(|_| counts.used() > 0) else {
        return Err(EvaluateError::NoReturns(drops_in_words(&counts)));
    };
    peak::look();

    let total_s = start.elapsed().as_secs_f64();
    let timing = PassTimes {
        plan_s,
        fuse_s: totals.fuse_s / threads as f64,
        trails_s: totals.trails_s / threads as f64,
        cast_s: totals.cast_s / threads as f64,
        drift_s: 0.0,
        total_s,
        threads: means.threads,
    };
    let since = outline.bytes_read().zip(read_before).map(|(now, before)| now - before);
    let bytes_read = since.zip(outline.own_bytes_read()).map(|(since, own)| since + own);
    let fused = FuseTotals { counts: Some(totals.fused), scratch_bytes: totals.scratch_bytes };
    // A place has its own maps: their tiles come into reach once.
    let tiles_in_reach = totals.maps.iter().map(|map| map.tiles).sum();
    let scored = Scored {
        frames: totals.scans_scored,
        places: Some(sample.report(&way, (quick, looks), totals.scans_read, bytes_read)),
        scan_of_unit: sample.middles,
        confidence,
        counts,
        odd_scans: Vec::new(),
        copied_scans: Vec::new(),
        tiles: totals.tiles,
        tile_loads: totals.tile_loads,
        tiles_in_reach,
        tile_visits: tiles_in_reach,
        lattice,
        reducer,
    };
    let summary = |report| MapSummary { report, facts: MapFacts { fused: true, ..MapFacts::default() } };
    let report_runs = placed.iter().zip(totals.maps).map(|(run, report)| run.like(summary(report)));
    let findings = Findings {
        heads,
        damage: &all_damage(outline, totals.damage),
        settings: &settings,
        means: &means,
        plan: &plan,
        runs: &report_runs.collect::<Vec<_>>(),
        fused,
        scored: &scored,
        timing,
    };
    let mut report = findings.report();
    report.memory.disk_bytes = totals.scratch_bytes + totals.map_bytes;
    Ok(report)
}

/// Approximate number of bytes of the log that [`evaluate_quick`] reads for these runs, where it grows for the first
/// look; bytes read twice count twice. It is computed from the index and the trajectories; no scan is read.
///
/// # Errors
/// As [`evaluate_quick`].
pub fn quick_reads(
    outline: &LogOutline,
    runs: &[Run],
    config: &Config,
    quick: Quick,
) -> Result<u64, EvaluateError> {
    let (settings, means) = config.on(outline.summary())?;
    check(runs, &settings, &means, quick)?;
    let (_, drive, placed) = placed(outline, runs, &settings)?;
    let scans = DriveScans::new(outline, &drive, &placed);
    Ok(Places::choose(&scans, &Way::new(&scans), settings.seed, quick)?.bytes)
}

/// The scans in use, those of them that all runs have, and the runs without maps.
type Placed<'a> = (Selection, Drive, Vec<PosedRun<'a, Option<Store>>>);

/// The drive by the log's index, and its runs.
fn placed<'a>(
    outline: &'a LogOutline,
    runs: &'a [Run],
    settings: &Settings,
) -> Result<Placed<'a>, EvaluateError> {
    check_runs(runs)?;
    let heads = Heads::Outline(outline);
    let stores = runs.iter().map(|_| None).collect();
    let selection = Selection::new(heads, settings)?;
    let placed = own_frame::place(heads, &selection.frames, runs, stores, settings)?;
    let paths: Vec<_> = placed.iter().map(|run| &*run.path).collect();
    let drive = Drive::new(&selection.frames, &paths);
    let by_stamp = placed.iter().any(|run| run.poses.pairing == Pairing::ByStamp);
    if by_stamp && outline.stamp_error_ns() > VAGUE_NS {
        let (path, error_ns) = (outline.summary().path.clone(), outline.stamp_error_ns());
        return Err(EvaluateError::VagueStamps { path, error_s: error_ns as f64 / 1e9 });
    }
    Ok((selection, drive, placed))
}

/// All damage to the log seen so far, in the order of the places on any number of threads.
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

/// Rejects settings that a sample of places does not support.
fn check(runs: &[Run], settings: &Settings, means: &Means, quick: Quick) -> Result<(), EvaluateError> {
    let bad = |value: String, why| Err(EvaluateError::setting(SettingName::Quick, value, why));
    if let Quick::Share(share) = quick
        && !(share > 0.0 && share <= 1.0)
    {
        return bad(format!("{share}"), "it must be a share of the log's bytes above 0 and at most 1");
    }
    let lengths = settings.scales.lengths();
    if !lengths.has_quick {
        return bad(format!("of a {}", lengths.name), "its places of 10 m are for drives");
    }
    if runs.iter().any(|run| run.map != MapSource::Fused) {
        return bad("with a given map".into(), "it makes the maps of places itself");
    }
    if means.save_maps.is_some() || means.checkpoint_every.is_some() || means.resume {
        return bad("with a setting for whole maps".into(), "it makes maps of places only");
    }
    Ok(())
}
