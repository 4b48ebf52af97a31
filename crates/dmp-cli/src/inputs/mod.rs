//! A log and its runs on the command line.

pub(crate) mod announce;
mod clock;
pub(crate) mod extrinsic;
mod loaded_run;
mod log_input;
mod opened_runs;
mod runs;
pub(crate) mod vetting;

pub(crate) use clock::RunClock;
pub(crate) use loaded_run::LoadedRun;
pub(crate) use log_input::{LogHead, LogInput, in_threads};
pub(crate) use opened_runs::{OpenedRuns, to_score};
pub(crate) use runs::Runs;
