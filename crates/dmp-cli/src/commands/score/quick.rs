//! A quick score of a log, unless it is a short one.

use dmp::{Config, evaluate_quick, quick_steps};
use dmp_draw::text::counted;

use super::whole::ScoredRuns;
use crate::console::{Common, Progress, say};
use crate::inputs::{LogInput, OpenedRuns, Runs, vetting};
use crate::options::Asked;

/// A quick score; the runs where a log is so short that all of it is scored.
pub(super) fn score(
    asked: &Asked,
    (log, started): (&LogInput, Runs),
    config: &Config,
    common: &Common,
) -> anyhow::Result<Result<ScoredRuns, Runs>> {
    let config = Config { checkpoint_every: None, ..config.clone() };
    let opened = OpenedRuns::outline_if(started, log, asked, common, |log| {
        let scans = log.scans().len();
        let is_enough = !quick_steps(scans).is_empty();
        if !is_enough && !common.quiet {
            say!(
                common.host,
                "note: all is scored: {} are too few for --quick",
                counted(scans as u64, "scan")
            );
        }
        is_enough
    })?;
    let opened = match opened {
        Ok(opened) => opened,
        Err(started) => return Ok(Err(started)),
    };
    let (opened, vetted) = vetting::checked_outline(opened, log, asked, &config, common)?;
    let OpenedRuns { log, runs, unread, damaged, .. } = opened;
    let report = evaluate_quick(&log, &runs, &config, &Progress::new(common))?;
    let report = vetting::reported(report, vetted.as_ref(), &unread);
    // What is lost shows where it is read.
    let damaged = damaged || !report.inputs.damage.is_empty();
    Ok(Ok(ScoredRuns { report, damaged, recorded: None }))
}
