//! Wrong conventions: found, told and put right before runs are scored.

use clap::Args;
use dmp::{Config, Report, Vetted, vet, vet_outline};
use dmp_log::LogOutline;

use crate::clock_args::ClockArgs;
use crate::common::Common;
use crate::exit::option_of;
use crate::log_args::LogArgs;
use crate::progress::Progress;
use crate::runs::OpenedRuns;
use crate::settings::PlaceArgs;
use crate::vetting::{Vetting, tell};

/// What is done about wrong conventions.
#[derive(Debug, Args)]
pub(crate) struct ConventionArgs {
    /// Put right what is surely wrong with the clock, the mounting or the reading of a run, found by a few scans; without it
    /// that is told, with the option that puts it right
    #[arg(long, help_heading = "Place and time")]
    mend: bool,
    /// Do not look for what is wrong with runs, and leave none out
    #[arg(long, conflicts_with = "mend", help_heading = "Place and time")]
    trust: bool,
}

impl ConventionArgs {
    /// The runs to be scored, and what was found of all that were given; `None` where nobody looks.
    pub(crate) fn vet(
        &self,
        opened: OpenedRuns,
        log: &LogArgs,
        (place, clock): (&PlaceArgs, &ClockArgs),
        config: &Config,
        common: &Common,
    ) -> anyhow::Result<(OpenedRuns, Option<Vetted>)> {
        if self.trust {
            return Ok((opened, None));
        }
        let mapper = place.mapper(clock.offset_of_all_ns())?;
        let (opened, vetted) = Vetting { log, mend: self.mend }.vet(
            opened,
            |log| log.open(&mapper, config.threads),
            |log, runs| vet(log.as_ref(), runs, config, self.mend, &Progress::new(common)),
        )?;
        tell(&vetted, common);
        Ok((opened, Some(vetted)))
    }

    /// The same by the index of a log.
    pub(super) fn vet_outline(
        &self,
        opened: OpenedRuns<LogOutline>,
        log: &LogArgs,
        (place, clock): (&PlaceArgs, &ClockArgs),
        config: &Config,
        common: &Common,
    ) -> anyhow::Result<(OpenedRuns<LogOutline>, Option<Vetted>)> {
        if self.trust {
            return Ok((opened, None));
        }
        let mapper = place.mapper(clock.offset_of_all_ns())?;
        let (opened, vetted) = Vetting { log, mend: self.mend }.vet(
            opened,
            |log| log.outline(&mapper),
            |log, runs| vet_outline(log, runs, config, self.mend, &Progress::new(common)),
        )?;
        tell(&vetted, common);
        Ok((opened, Some(vetted)))
    }
}

/// The report with what was found before.
pub(super) fn told(mut report: Report, vetted: Option<&Vetted>) -> Report {
    if let Some(vetted) = vetted {
        vetted.summary(&option_of).put_into(&mut report);
    }
    report
}
