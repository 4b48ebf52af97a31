//! Checks of runs before they are scored: wrong clocks, extrinsics and formats are detected, reported, and with `--mend` fixed.

use dmp::{Config, EvaluateError, PointTimes, Report, Run, Vetted, vet, vet_outline};
use dmp_log::LogOutline;

use super::log_input::LogInput;
use super::runs::OpenedRuns;
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
    if asked.has(&input::TRUST) {
        return Ok((opened, None));
    }
    let mend = asked.has(&input::MEND);
    let (opened, vetted) = with_log(opened, log, mend, config, common)?;
    tell(&vetted, asked, common);
    Ok((opened, Some(vetted)))
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
    if asked.has(&input::TRUST) {
        return Ok((opened, None));
    }
    let mend = asked.has(&input::MEND);
    let (opened, vetted) = check(opened, (log, mend), LogInput::outline, |log, runs| {
        vet_outline(log, runs, config, mend, &Progress::new(common))
    })?;
    tell(&vetted, asked, common);
    Ok((opened, Some(vetted)))
}

/// The report with what was found before.
pub(crate) fn reported(mut report: Report, vetted: Option<&Vetted>) -> Report {
    if let Some(vetted) = vetted {
        vetted.summary(&option_of).put_into(&mut report);
    }
    report
}

/// `look` vets runs on a log that `open` has opened. The log is opened another way where its points call for that.
fn check<L, E>(
    opened: OpenedRuns<L>,
    (input, mend): (&LogInput, bool),
    open: impl Fn(&LogInput) -> Result<L, E>,
    look: impl Fn(&L, &[Run]) -> Result<Vetted, EvaluateError>,
) -> anyhow::Result<(OpenedRuns<L>, Vetted)> {
    let OpenedRuns { mut log, runs, damaged } = opened;
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
    Ok((OpenedRuns { log, runs, damaged }, vetted))
}

fn tell(vetted: &Vetted, asked: &Asked, common: &Common) {
    let has_report = asked.spec().name == "score" && !asked.has(&output::JSON);
    if !common.quiet && !has_report {
        vetted.messages_with(&option_of).iter().for_each(|message| say!(common.host, "note: {message}"));
    }
}
