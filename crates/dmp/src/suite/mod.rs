//! Versions of a SLAM beside each other on several logs: what the reports of all logs say together.

mod build;
mod contents;
mod effect;
mod judge;
mod log;
mod pair;
#[cfg(test)]
mod tests;

pub use build::suite_report;
pub use contents::{MissingReport, SuiteLogReport, SuitePromiseReport, SuiteReport};
pub use effect::EffectReport;
pub use log::SuiteLog;
pub use pair::{LogPairReport, Outcome, SuitePairReport};
