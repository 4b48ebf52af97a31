//! Joins reports of runs that were scored separately on one log with the same settings.

mod error;
mod follow;
mod kept;
mod named;
mod names;
mod reports;
mod results;
mod same;
#[cfg(test)]
mod tests;

pub use error::{JoinError, MadeWith};
pub use follow::Follow;
pub use named::NamedReport;
pub use reports::{JoinedReport, join_reports};
pub use results::{SavedResult, join_results};
