//! Reports beside each other: of runs of one log that were scored apart, under one setting.

mod error;
mod kept;
mod named;
mod names;
mod reports;
mod results;
mod same;
#[cfg(test)]
mod tests;

pub use error::{JoinError, MadeWith};
pub use named::NamedReport;
pub use reports::{JoinedReport, join_reports};
pub use results::{SavedResult, join_results};
