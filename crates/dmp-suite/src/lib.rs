//! Several reports as one: of runs that were scored apart on one log, and of one set of runs on several logs.

mod join;
#[cfg(test)]
#[path = "../../dmp-report/src/sample_data.rs"]
mod sample_data;
mod suite;

#[cfg(test)]
use dmp_report::Report;

pub use join::{
    Follow, JoinError, JoinedReport, MadeWith, NamedReport, SavedResult, join_reports, join_results,
};
pub use suite::{
    EffectReport, FailureReport, Failures, LogPairReport, MissingReport, Outcome, SuiteLog, SuiteLogReport,
    SuitePairReport, SuitePromiseReport, SuiteReport, suite_report,
};
