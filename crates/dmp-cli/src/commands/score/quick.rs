//! A quick score of a log, unless it is a short one.

use dmp::{Config, Quick, Report, evaluate_quick, quick_reads};
use dmp_draw::text;

use crate::console::{Common, Progress, say};
use crate::inputs::{LogInput, OpenedRuns, Runs, vetting};
use crate::options::Asked;

/// The share of a log's bytes up to which it saves something to read them for places, rather than all once for each pass.
const MOST_READ: f64 = 0.5;

/// A quick score, and whether part of what it read is lost; `None` of a log that is so short that all of it is better scored.
pub(super) fn score(
    asked: &Asked,
    log: &LogInput,
    config: &Config,
    quick: Quick,
    common: &Common,
) -> anyhow::Result<Option<(Report, bool)>> {
    let config = Config { checkpoint_every: None, ..config.clone() };
    let started = Runs::start(asked)?;
    let opened = OpenedRuns::outline_if(started, log, asked, common, |log, runs| {
        let (reads, all) = (quick_reads(log, runs, &config, quick)?, log.bytes());
        let most = if let Quick::Share(share) = quick { share.max(MOST_READ) } else { MOST_READ };
        let is_enough = reads as f64 <= all as f64 * most || most >= 1.0;
        if !is_enough && !common.quiet {
            let [reads, all] = [reads, all].map(text::bytes);
            say!(common.host, "note: all is scored: --quick would read {reads} of this log of {all}");
        }
        Ok(is_enough)
    })?;
    let Some(opened) = opened else { return Ok(None) };
    let (opened, vetted) = vetting::checked_outline(opened, log, asked, &config, common)?;
    let OpenedRuns { log, runs, damaged } = opened;
    let report = evaluate_quick(&log, &runs, &config, quick, &Progress::new(common))?;
    let report = vetting::reported(report, vetted.as_ref());
    // What is lost shows where it is read.
    let damaged = damaged || !report.inputs.damage.is_empty();
    Ok(Some((report, damaged)))
}
