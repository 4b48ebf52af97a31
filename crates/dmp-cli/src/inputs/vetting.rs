//! Checks of runs before they are scored: wrong clocks, extrinsics and formats are detected, reported, and with `--mend` fixed.

use dmp::{
    Config, EvaluateError, LeftOutReport, PointTimes, Report, Run, VetSummary, Vetted, vet, vet_outline,
};
use dmp_log::LogOutline;

use super::log_input::LogInput;
use super::opened_runs::OpenedRuns;
use crate::console::{Common, Progress, option_of, say};
use crate::options::{Asked, input, output};

/// The runs to be scored, and what was found of all that were given; `None` where nothing is checked. It is told at once, unless a
/// report will say it.
pub(crate) fn checked(
    opened: OpenedRuns,
    log: &LogInput,
    asked: &Asked,
    config: &Config,
    common: &Common,
) -> anyhow::Result<(OpenedRuns, Option<Vetted>)> {
    let mend = asked.has(&input::MEND);
    let vet = |opened| with_log(opened, log, mend, config, common);
    told(opened, vet, asked, common)
}

/// The same with an open log, and without a word.
pub(crate) fn with_log(
    opened: OpenedRuns,
    log: &LogInput,
    mend: bool,
    config: &Config,
    common: &Common,
) -> anyhow::Result<(OpenedRuns, Vetted)> {
    check(
        opened,
        (log, mend),
        |log| log.open(config.threads),
        |log, runs| vet(log.as_ref(), runs, config, mend, &Progress::new(common)),
    )
}

/// The same by the index of a log.
pub(crate) fn checked_outline(
    opened: OpenedRuns<LogOutline>,
    log: &LogInput,
    asked: &Asked,
    config: &Config,
    common: &Common,
) -> anyhow::Result<(OpenedRuns<LogOutline>, Option<Vetted>)> {
    let mend = asked.has(&input::MEND);
    let vet = |opened| {
        check(opened, (log, mend), LogInput::outline, |log, runs| {
            vet_outline(log, runs, config, mend, &Progress::new(common))
        })
    };
    told(opened, vet, asked, common)
}

/// What was found before, for a report.
pub(crate) fn summary(vetted: Option<&Vetted>, unread: &[LeftOutReport]) -> VetSummary {
    let mut summary = vetted.map_or_else(VetSummary::default, |vetted| vetted.summary(&option_of));
    summary.leave_out(unread);
    summary
}

/// The report with what was found before.
pub(crate) fn reported(mut report: Report, vetted: Option<&Vetted>, unread: &[LeftOutReport]) -> Report {
    summary(vetted, unread).put_into(&mut report);
    report
}

/// `look` vets runs on a log that `open` has opened. The log is opened another way where its points call for that.
fn check<L, E>(
    opened: OpenedRuns<L>,
    (input, mend): (&LogInput, bool),
    open: impl Fn(&LogInput) -> Result<L, E>,
    look: impl Fn(&L, &[Run]) -> Result<Vetted, EvaluateError>,
) -> anyhow::Result<(OpenedRuns<L>, Vetted)> {
    let OpenedRuns { mut log, runs, unread, is_read, damaged } = opened;
    let mut vetted = look(&log, &runs)?;
    if let (true, PointTimes::Corrected(sweep)) = (mend, vetted.point_times) {
        // A log that cannot be read without them is scored as it is; a message says so.
        if let Ok(without) = open(&input.without_point_times()) {
            log = without;
            vetted = look(&log, &runs)?;
            vetted.point_times = PointTimes::LeftAside(sweep);
        }
    }
    if let Some(timed) = input.with_point_times() {
        // Times that cannot be understood are rightly ignored.
        if let Ok(timed) = open(&timed)
            && look(&timed, &runs)?.points_are_raw()
        {
            vetted.point_times = PointTimes::Unused;
        }
    }
    let runs = vetted.runs.clone();
    Ok((OpenedRuns { log, runs, unread, is_read, damaged }, vetted))
}

/// What `vet` finds, unless runs are trusted, told where no report will say it.
fn told<L>(
    opened: OpenedRuns<L>,
    vet: impl FnOnce(OpenedRuns<L>) -> anyhow::Result<(OpenedRuns<L>, Vetted)>,
    asked: &Asked,
    common: &Common,
) -> anyhow::Result<(OpenedRuns<L>, Option<Vetted>)> {
    let (opened, vetted) = if asked.has(&input::TRUST) {
        (opened, None)
    } else {
        let (opened, vetted) = vet(opened)?;
        (opened, Some(vetted))
    };
    let is_score = asked.spec().name == "score";
    if !is_score || asked.has(&output::JSON) {
        let summary = summary(vetted.as_ref(), &opened.unread);
        // Other results do not say that a run is missing.
        let is_told = |message: &&String| !common.quiet || !is_score && summary.leaves_out_by(message);
        let told = summary.messages().iter().filter(is_told);
        told.for_each(|message| say!(common.host, "note: {message}"));
    }
    Ok((opened, vetted))
}
