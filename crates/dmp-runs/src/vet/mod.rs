//! Checks runs for wrong poses, clocks and extrinsics before anything is shared between them.
//!
//! Each run is checked separately on the same few scans: does it have poses for them, does another
//! interpretation of its poses fit far better, at which instant do they hold, and how large are its clock offset
//! and extrinsic error. A run is excluded only where its own scans contradict it beyond doubt.
//! `docs/conventions.md` has the measurements.

mod copies;
mod depth_units;
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

use crate::asked::pool;
use crate::asked::{Config, EvaluateError, Progress, Run, Stage, check_runs};
use crate::runs::Heads;
pub use found::{Doubt, DoubtTest, Found};
use look::Look;
pub use mend::Mend;
pub use poses_as::PosesAs;
pub use profile::{Profile, profiles};
use sample::Extent;
pub use summary::VetSummary;
pub use vetted::{PointTimes, Vetted};
use vetted::{alike, corrected};

/// Checks every run separately and excludes those that its scans contradict beyond doubt. With `mend`, fixes errors that
/// are certain. Poses without stamps are put at the instant of the scans that the scans show.
///
/// Reads up to 192 scans, evenly spread over the log. Takes a second or two per run.
///
/// # Errors
/// When the log cannot be read, a setting is invalid, or every run is excluded.
pub fn vet(
    log: &dyn ScanLog,
    runs: &[Run],
    config: &Config,
    mend: bool,
    progress: &dyn Progress,
) -> Result<Vetted, EvaluateError> {
    vet_heads(Heads::Log(log), runs, config, mend, progress)
}

/// The same with fewer scans, up to 80, of a log of which only the index was read; the instant of poses without stamps is sought
/// on as many as ever.
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
    given: &[Run],
    config: &Config,
    mend: bool,
    progress: &dyn Progress,
) -> Result<Vetted, EvaluateError> {
    let (settings, means) = config.on(heads.summary())?;
    check_runs(given)?;
    let extent = if matches!(heads, Heads::Log(_)) { Extent::Full } else { Extent::Few };
    let pool = pool(means.threads)?;
    let read = |extent: Extent| pool.install(|| sample::read(heads, extent, &settings, progress));
    let blocks = read(extent)?;
    // Few scans do not show an instant. What else is said of a run does not depend on whether others have stamps.
    let is_open = extent == Extent::Few && given.iter().any(look::has_open_instant);
    let more = is_open.then(|| read(Extent::Full)).transpose()?;
    let of_instant = more.as_deref().unwrap_or(&blocks);
    let look = Look { heads, settings: &settings, blocks: &blocks, of_instant };
    depth_units::check(&look, given)?;
    progress.begin(Stage::Vet, given.len() as u64);
    let at = |run: &Run| {
        let found = if progress.cancelled() { Err(EvaluateError::Cancelled) } else { look.at(run) };
        progress.advance(1);
        found
    };
    let all = || given.iter().map(at).collect::<Result<Vec<_>, _>>();
    let mut found = pool.install(all)?;
    let corrected = corrected(&found);
    for (run, found) in given.iter().zip(&mut found) {
        look.add_mends(run, found, corrected.is_some());
    }
    let doubts = || {
        let both = given.iter().zip(&found);
        both.map(|(run, found)| look.doubt_of(found, run)).collect::<Result<Vec<_>, _>>()
    };
    let doubts = pool.install(doubts)?;
    found.iter_mut().zip(doubts).for_each(|(found, doubt)| found.doubt = doubt);
    let as_scored = |(run, found): (&Run, &Found)| {
        if mend && found.can_be_mended {
            return found.fixed(run);
        }
        Run { pose_at: found.instant.or(run.pose_at), ..run.clone() }
    };
    let kept = given.iter().zip(&found).filter(|(_, found)| found.is_kept());
    let runs: Vec<Run> = kept.map(as_scored).collect();
    if runs.is_empty() {
        return Err(nothing_is_left(found));
    }
    let copies = copies::groups(given);
    let alike = alike(&found, &copies);
    let point_times = corrected.map_or(PointTimes::AsUsed, PointTimes::Corrected);
    Ok(Vetted { runs, found, mended: mend, alike, copies, point_times })
}

/// The error where no run can be scored: that of the first.
fn nothing_is_left(found: Vec<Found>) -> EvaluateError {
    let mut errors = found.into_iter().map(|found| {
        let why = found.doubt.map(|doubt| doubt.message()).unwrap_or_default();
        found.not_paired.map_or(EvaluateError::OtherLog { name: found.name, why }, |error| *error)
    });
    errors.next().unwrap_or(EvaluateError::NoRuns)
}
