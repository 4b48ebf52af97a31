//! Looking at runs before they are scored, with the log opened another way where its points call for that.

use dmp::{EvaluateError, PointTimes, Run, Vetted};

use crate::common::Common;
use crate::exit::option_of;
use crate::log_args::LogArgs;
use crate::runs::OpenedRuns;
use crate::say::say;

/// How a log was opened, and whether what is wrong is to be put right.
pub(crate) struct Vetting<'a> {
    pub(crate) log: &'a LogArgs,
    pub(crate) mend: bool,
}

impl Vetting<'_> {
    /// The runs to be scored, with the log to score them on, and what was found of all. `look` vets runs on a log that `open`
    /// has opened.
    pub(crate) fn vet<L, E>(
        &self,
        opened: OpenedRuns<L>,
        open: impl Fn(&LogArgs) -> Result<L, E>,
        look: impl Fn(&L, &[Run]) -> Result<Vetted, EvaluateError>,
    ) -> anyhow::Result<(OpenedRuns<L>, Vetted)> {
        let OpenedRuns { mut log, runs, damaged } = opened;
        let mut vetted = look(&log, &runs)?;
        if let (true, PointTimes::Corrected(sweep)) = (self.mend, vetted.point_times) {
            // A log that cannot be read so is scored as it is, and that is said.
            if let Ok(without) = open(&self.log.without_point_times()) {
                log = without;
                vetted = look(&log, &runs)?;
                vetted.point_times = PointTimes::LeftAside(sweep);
            }
        }
        if let Some(timed) = self.log.with_point_times() {
            // Times that cannot be understood are rightly left aside.
            if let Ok(timed) = open(&timed)
                && look(&timed, &runs)?.points_are_raw()
            {
                vetted.point_times = PointTimes::Unused;
            }
        }
        let runs = vetted.runs.clone();
        Ok((OpenedRuns { log, runs, damaged }, vetted))
    }
}

/// Says what was found.
pub(crate) fn tell(vetted: &Vetted, common: &Common) {
    if !common.quiet {
        vetted.messages_with(&option_of).iter().for_each(|message| say!(common.host, "note: {message}"));
    }
}
