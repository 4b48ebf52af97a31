//! All scans of a log scored. The log is checked while they are read; what nobody reads is not checked.

use dmp::{Config, EvaluateError, MapSource, Report, Vetted, check_memory, evaluate};
use dmp_log::LogError;

use super::outputs::{Outputs, Recorded, Recorder};
use crate::console::{Common, one_line, say};
use crate::inputs::{LogHead, LogInput, OpenedRuns, Runs, announce, vetting};
use crate::options::Asked;

/// What was found, and what is to be written of it.
pub(super) struct ScoredRuns {
    pub(super) report: Report,
    /// Whether part of the log or of a run is lost.
    pub(super) damaged: bool,
    /// `None` where nothing was kept beside the report.
    pub(super) recorded: Option<Recorded>,
}

/// Scores runs on all scans. Where a scan turns out to be damaged, the log is opened again and goes without it.
pub(super) fn score(
    asked: &Asked,
    (log, started, maps): (&LogInput, Runs, Vec<MapSource>),
    outputs: Outputs,
    config: &Config,
    common: &Common,
) -> anyhow::Result<ScoredRuns> {
    let as_read = log.checked_as_read();
    let opened = OpenedRuns::open(started, maps, &as_read, asked, config.threads, common)?;
    let again = opened.runs_only();
    match scored(asked, (&as_read, opened), outputs.clone(), config, common) {
        Err(error) if is_unchecked(&error) => {
            let opened = again.on(log.open(config.threads)?);
            if !common.quiet {
                say!(
                    common.host,
                    "note: {}; the scores begin again without what is damaged",
                    one_line(&error)
                );
                announce::found(&common.host, LogHead::of_log(opened.log.as_ref()), &[]);
            }
            scored(asked, (log, opened), outputs, config, common)
        }
        scored => scored,
    }
}

fn scored(
    asked: &Asked,
    (log, opened): (&LogInput, OpenedRuns),
    outputs: Outputs,
    config: &Config,
    common: &Common,
) -> anyhow::Result<ScoredRuns> {
    check_memory(opened.log.as_ref(), &opened.runs, config)?;
    let (opened, vetted) = vetting::checked(opened, log, asked, config, common)?;
    let OpenedRuns { log, runs, unread, is_read, damaged } = opened;
    let (settings, means) = config.on(log.summary())?;
    let is_kept = vetted.as_ref().map_or_else(|| vec![true; runs.len()], Vetted::is_kept);
    let outputs = outputs.of_runs(&is_read).of_runs(&is_kept);
    let recorder = Recorder::new(outputs, log.as_ref(), &runs, (&settings, &means), common)?;
    let evaluated = evaluate(log.as_ref(), &runs, config, (&recorder, &recorder));
    let evaluated = evaluated.map(|report| vetting::reported(report, vetted.as_ref(), &unread));
    let (report, recorded) = recorder.end(evaluated)?;
    Ok(ScoredRuns { report, damaged, recorded: Some(recorded) })
}

/// Whether a scan is damaged that was not checked when the log was opened.
fn is_unchecked(error: &anyhow::Error) -> bool {
    let of_log = match error.downcast_ref() {
        Some(EvaluateError::Log(error)) => Some(error),
        _ => error.downcast_ref::<LogError>(),
    };
    matches!(of_log, Some(LogError::Unchecked { .. }))
}
