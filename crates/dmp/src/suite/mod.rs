//! Versions of a SLAM beside each other on several logs: what the reports of all logs say together.

mod build;
mod contents;
mod effect;
mod judge;
mod log;
mod outcome;
mod pair;
#[cfg(test)]
mod tests;

pub use build::suite_report;
pub use contents::{SuiteLogReport, SuitePromiseReport, SuiteReport};
pub use effect::EffectReport;
pub use log::{MissingReport, SuiteLog};
pub use outcome::Outcome;
pub use pair::{LogPairReport, SuitePairReport};
