//! The report of what the passes found, and what it warns of.

mod account;
mod findings;
mod warnings;

pub(crate) use findings::{Findings, MapSummary, map_report, segment_report};
