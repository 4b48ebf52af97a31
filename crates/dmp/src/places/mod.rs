//! A quick score: of a sample of places along the way, each by itself, so that only the scans that see them are read.

mod choice;
mod draw;
mod pass;
mod scans;
mod score;
mod survey;
mod way;
mod whereabouts;

use std::time::Instant;

use dmp_log::{Damage, LogOutline};
use dmp_map::Store;
use dmp_sensor::DropReason;

use crate::cast::Scored;
use crate::config::{Config, MapSource, Run};
use crate::error::{EvaluateError, Remedy};
use crate::evaluation::{FuseTotals, check_runs};
use crate::heads::Heads;
use crate::own_frame;
use crate::pairing::Pairing;
use crate::peak;
use crate::plan::Drive;
use crate::report::{Findings, MapSummary, PassTimes, Report, drops_in_words};
use crate::run_state::RunState;
use crate::sample::{Looks, Sample};
use crate::setting_name::SettingName;
use crate::settings::{Means, Settings};
use crate::watch::Watch;
use crate::work::{MapFacts, pool};
use choice::Places;
pub use draw::drawn_places;
use pass::Pass;
use scans::DriveScans;
use way::Way;

/// Stamps that are known no better than this, nanoseconds, do not tell where a scan was made.
const VAGUE_NS: i64 = 1_000_000_000;

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
pub fn evaluate_quick<'a>(
    outline: &'a LogOutline,
    runs: &'a [Run],
    config: &Config,
    share: f64,
    watch: impl Into<Watch<'a>>,
) -> Result<Report, EvaluateError> {
    let watch = watch.into();
    let (settings, means) = config.on(outline.summary())?;
    check(runs, &settings, &means, share)?;
    let start = Instant::now();
    let read_before = outline.bytes_read();
    let heads = Heads::Outline(outline);
    let (drive, placed) = placed(outline, runs, &settings)?;
    let scans = DriveScans::new(outline, &drive, &placed);
    let way = Way::new(&scans);
    let sample = Places::choose(&scans, &way, settings.seed, share)?;

    // The same returns z, voxels and segments for every run and every place.
    let (all, drawn) = (sample.total as u64, sample.drawn.len() as u64);
    let looks = Looks::new(all, Sample::Frames(drawn), settings.seed, false);
    let pool = pool(means.threads)?;
    let surveyed = survey::look(&scans, &way, &sample.drawn, looks, &settings, &pool, watch.progress)?;
    drop(pool);
    let plan_s = start.elapsed().as_secs_f64();

    // Every place as a log of its own: its map, and the sums of its returns. The places are the units that the error
    // of the sampling comes from.
    let pass =
        Pass { scans: &scans, surveyed: &surveyed, asked: runs, settings: &settings, means: &means, watch };
    let (reducer, totals, threads) = pass.run(&sample.drawn, all)?;
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
        trails_s: 0.0,
        cast_s: totals.cast_s / threads as f64,
        drift_s: 0.0,
        total_s,
        threads: means.threads,
    };
    let since = outline.bytes_read().zip(read_before).map(|(now, before)| now - before);
    let bytes_read = since.zip(outline.own_bytes_read()).map(|(since, own)| since + own);
    let fused = FuseTotals { counts: Some(totals.fused), left_out: 0, scratch_bytes: totals.scratch_bytes };
    // A place has its maps by itself: their tiles are what is in reach, once.
    let tiles_in_reach = totals.maps.iter().map(|map| map.tiles).sum();
    let scored = Scored {
        frames: totals.scans_scored,
        places: Some(sample.report(&way, share, totals.scans_read, bytes_read)),
        scan_of_unit: sample.middles,
        looks: vec![reducer.frames_added()],
        promise: settings.promise(),
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
    let told = |report| MapSummary { report, facts: MapFacts { fused: true, ..MapFacts::default() } };
    let told_runs = surveyed.runs.iter().zip(totals.maps).map(|(run, report)| run.like(told(report)));
    let findings = Findings {
        heads,
        damage: &all_damage(outline, totals.damage),
        settings: &settings,
        means: &means,
        plan: &surveyed.plan,
        runs: &told_runs.collect::<Vec<_>>(),
        fused,
        scored: &scored,
        timing,
    };
    let mut report = findings.report();
    report.memory.disk_bytes = totals.scratch_bytes + totals.map_bytes;
    Ok(report)
}

/// About how many bytes of the log [`evaluate_quick`] reads for these runs, what is read twice counted twice. The index and the
/// trajectories tell it; no scan is read for it.
///
/// # Errors
/// As [`evaluate_quick`].
pub fn quick_reads(
    outline: &LogOutline,
    runs: &[Run],
    config: &Config,
    share: f64,
) -> Result<u64, EvaluateError> {
    let (settings, means) = config.on(outline.summary())?;
    check(runs, &settings, &means, share)?;
    let (drive, placed) = placed(outline, runs, &settings)?;
    let scans = DriveScans::new(outline, &drive, &placed);
    Ok(Places::choose(&scans, &Way::new(&scans), settings.seed, share)?.bytes)
}

/// A drive, and the runs along it, which have no maps yet.
type Placed<'a> = (Drive, Vec<RunState<'a, Option<Store>>>);

/// The drive by the index of the log, and the runs along it.
fn placed<'a>(
    outline: &'a LogOutline,
    runs: &'a [Run],
    settings: &Settings,
) -> Result<Placed<'a>, EvaluateError> {
    check_runs(runs, settings)?;
    let heads = Heads::Outline(outline);
    let stores = runs.iter().map(|_| None).collect();
    let mut placed = own_frame::place(heads, runs, stores, settings)?;
    let drive = Drive::new(heads, &mut placed, settings)?;
    let by_stamp = placed.iter().any(|run| run.poses.pairing == Pairing::ByStamp);
    if by_stamp && outline.stamp_error_ns() > VAGUE_NS {
        let (path, error_ns) = (outline.summary().path.clone(), outline.stamp_error_ns());
        return Err(EvaluateError::VagueStamps { path, error_s: error_ns as f64 / 1e9 });
    }
    Ok((drive, placed))
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
fn check(runs: &[Run], settings: &Settings, means: &Means, share: f64) -> Result<(), EvaluateError> {
    let bad = |value: String, why| Err(EvaluateError::setting(SettingName::Quick, value, why));
    let sample_scans = |value, why| {
        let (setting, remedy) = (SettingName::Quick, Some(Remedy::SampleScans));
        Err(EvaluateError::Setting { setting, value, why, remedy })
    };
    if !(share > 0.0 && share <= 1.0) {
        return bad(format!("{share}"), "it must be a share of the log's bytes above 0 and at most 1");
    }
    let lengths = settings.scales.lengths();
    if !lengths.has_quick {
        return sample_scans(format!("of a {}", lengths.name), "its places are those of a drive, 10 m long");
    }
    if runs.iter().any(|run| run.map != MapSource::Fused) {
        return sample_scans("with a given map".into(), "it makes the maps of places itself");
    }
    if settings.sample != Sample::All || settings.decide.is_some() {
        return bad("with a sample of scans".into(), "it is one or the other");
    }
    if settings.free_space || means.save_maps.is_some() || means.checkpoint_every.is_some() || means.resume {
        return bad("with a setting for whole maps".into(), "it makes maps of places, and none of all");
    }
    Ok(())
}
