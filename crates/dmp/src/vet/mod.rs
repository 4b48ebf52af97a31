//! Checks runs for wrong poses, clocks and extrinsics before anything is shared between them.
//!
//! Each run is checked separately on the same few scans: does it have poses for them, does another
//! interpretation of its poses fit far better, and how large are its clock offset and extrinsic error. A run
//! that does not belong is excluded from what runs share, so that the numbers of the others do not depend on
//! it. `docs/conventions.md` has the measurements.

mod found;
mod look;
mod mend;
mod poses_as;
mod profile;
mod readings;
mod sample;
mod summary;
mod vetted;

use dmp_log::{LogOutline, ScanLog};

use crate::config::{Config, Run};
use crate::error::EvaluateError;
use crate::evaluation::check_runs;
use crate::heads::Heads;
use crate::progress::{Progress, Stage};
use crate::work::pool;
pub use found::{Found, LeftOut};
use look::Look;
pub use mend::Mend;
pub use poses_as::PosesAs;
pub use profile::{Profile, profiles};
pub use summary::VetSummary;
pub use vetted::{PointTimes, Vetted};
use vetted::{alike, corrected};

/// Checks every run separately and excludes those that do not belong to the log. With `mend`, fixes errors
/// that are certain. If no run belongs to the log, all are kept: the cause is then the log.
///
/// Reads up to 192 scans, evenly spread over the log. Takes a second or two per run.
///
/// # Errors
/// When the log cannot be read, or a setting is invalid.
pub fn vet(
    log: &dyn ScanLog,
    runs: &[Run],
    config: &Config,
    mend: bool,
    progress: &dyn Progress,
) -> Result<Vetted, EvaluateError> {
    vet_heads(Heads::Log(log), runs, config, mend, progress)
}

/// The same with fewer scans, up to 80, of a log of which only the index was read.
///
/// # Errors
/// As [`vet`].
pub fn vet_outline(
    outline: &LogOutline,
    runs: &[Run],
    config: &Config,
    mend: bool,
    progress: &dyn Progress,
) -> Result<Vetted, EvaluateError> {
    vet_heads(Heads::Outline(outline), runs, config, mend, progress)
}

fn vet_heads(
    heads: Heads<'_>,
    runs: &[Run],
    config: &Config,
    mend: bool,
    progress: &dyn Progress,
) -> Result<Vetted, EvaluateError> {
    let (settings, means) = config.on(heads.summary())?;
    check_runs(runs, &settings)?;
    let lent = runs.iter().find_map(|run| run.trajectory.stamps_ns());
    let blocks = sample::read(heads, &settings, progress)?;
    let look = Look { heads, lent, settings: &settings, blocks: &blocks };
    progress.begin(Stage::Vet, runs.len() as u64);
    let at = |run: &Run| {
        let found = if progress.cancelled() { Err(EvaluateError::Cancelled) } else { look.at(run) };
        progress.advance(1);
        found
    };
    let all = || runs.iter().map(at).collect::<Result<Vec<_>, _>>();
    let mut found = pool(means.threads)?.install(all)?;
    let corrected = corrected(&found);
    for (run, found) in runs.iter().zip(&mut found) {
        look.add_mends(run, found, corrected.is_some());
    }
    for found in &mut found {
        if mend && found.can_be_mended && matches!(found.left_out, Some(LeftOut::Misread)) {
            found.left_out = None;
        }
        found.is_kept = found.left_out.is_none();
    }
    if !found.iter().any(|found| found.is_kept) {
        found = kept_all_the_same(found)?;
    }
    let kept = runs.iter().zip(&found).filter(|(_, found)| found.is_kept);
    let as_scored = |(run, found): (&Run, &Found)| {
        let mut run = run.clone();
        if mend && found.can_be_mended {
            found.mends.iter().for_each(|mend| mend.apply(&mut run));
        }
        run
    };
    let runs = kept.map(as_scored).collect();
    let alike = alike(&found);
    let point_times = corrected.map_or(PointTimes::AsUsed, PointTimes::Corrected);
    Ok(Vetted { runs, found, mended: mend, alike, point_times })
}

/// If no run belongs, keeps those with poses for the scans: the runs are not the cause. If none has poses,
/// returns the first error.
fn kept_all_the_same(mut found: Vec<Found>) -> Result<Vec<Found>, EvaluateError> {
    for found in &mut found {
        found.is_kept = !matches!(found.left_out, Some(LeftOut::NotPaired(_)));
    }
    if found.iter().any(|found| found.is_kept) {
        return Ok(found);
    }
    match found.swap_remove(0).left_out {
        Some(LeftOut::NotPaired(error)) => Err(*error),
        _ => Ok(found),
    }
}
