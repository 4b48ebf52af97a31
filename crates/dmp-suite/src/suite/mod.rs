//! Compares versions of a SLAM system on several logs, from the reports of all logs.

mod build;
mod contents;
mod effect;
mod failures;
mod log;
mod outcome;
mod pair;
mod sign_test;
#[cfg(test)]
mod tests;

pub use build::suite_report;
pub use contents::{SuiteLogReport, SuitePromiseReport, SuiteReport};
pub use effect::EffectReport;
pub use failures::{FailureReport, Failures};
pub use log::{MissingReport, SuiteLog};
pub use outcome::Outcome;
pub use pair::{LogPairReport, SuitePairReport};
