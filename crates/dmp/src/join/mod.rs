//! Reports beside each other: of runs of one log that were scored apart, under one setting.

mod error;
mod named;
mod names;
mod reports;
mod same;
#[cfg(test)]
mod tests;

pub use error::{JoinError, MadeWith};
pub use named::NamedReport;
pub use reports::{JoinedReport, join_reports};
